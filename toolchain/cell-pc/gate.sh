#!/usr/bin/env bash
# The emulated cell PC twice, side by side, and check.py on what they leave. Arguments go to both, see run.sh.
#
#     toolchain/cell-pc/gate.sh [--build DIR] [--cpu MODEL] [-- DEVICES...]
set -uo pipefail
cd "$(dirname "$0")/../.."

results=build/cell-pc
runs=() codes=()
end() { for run in "${runs[@]}"; do kill "$run" 2>/dev/null; done; }
trap end EXIT
mkdir -p $results
for number in 1 2; do
  toolchain/cell-pc/run.sh --out $results/gate-$number "$@" >$results/gate-$number.log 2>&1 &
  runs+=($!)
done
for run in "${runs[@]}"; do
  wait "$run"
  codes+=($?)
done
runs=()
cat $results/gate-1.log $results/gate-2.log
for code in "${codes[@]}"; do [ "$code" -eq 0 ] || exit "$code"; done
toolchain/cell-pc/check.py $results/gate-1 $results/gate-2
