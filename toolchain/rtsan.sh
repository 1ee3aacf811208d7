#!/usr/bin/env bash
# Proves with Clang that the control thread neither allocates nor waits: the preset `rtsan` refuses to compile what might
# (-Wfunction-effects), and a complete run of that program on real links (TCP, pseudo-terminal) must pass without a
# word of RealtimeSanitizer. Then the rule is broken on purpose in six ways, and each must stop the program.
#
# With --build the simulated devices come from that build; without it everything is set up and built.
#
#     ./toolchain/rtsan.sh [--build DIR] [options of moldloft-sim devices, such as --plate dome --seed 7]
set -euo pipefail
cd "$(dirname "$0")/.."

built=$PWD/build/release
if [ "${1:-}" = --build ]; then
  built=$2
  shift 2
else
  toolchain/setup.sh --tests
  cmake --preset release >/dev/null
  cmake --build --preset release --target moldloft-sim pty_modem
fi
cmake --preset rtsan >/dev/null
cmake --build --preset rtsan --target moldloft realtime_probe

bin=$PWD/build/rtsan/bin
. toolchain/devices.sh
start_devices "$built/bin/moldloft-sim" "$@"

# A sanitizer that stops at the first violation leaves no doubt: the exit code is that of a completed run, or it is not.
# Assertions are compiled in, and the program is several times slower than what is deployed: ticks may be missed.
run=0
LD_PRELOAD=$built/lib/libpty_modem.so timeout 300 \
  "$bin/moldloft" run "$scratch/cell.toml" --out "$scratch/run" >"$scratch/run.log" 2>&1 || run=$?
if [ "$run" -ne 0 ] || grep -q RealtimeSanitizer "$scratch/run.log"; then
  cat "$scratch/run.log" >&2
  echo "rtsan: the complete run ended with exit code $run" >&2
  exit 1
fi
ticks=$(sed -n 's/^  "ticks": \([0-9]*\),$/\1/p' "$scratch/run/timing.json")
echo "rtsan: a complete run on real links, $ticks ticks, 0 violations"

for how in heap new lock sleep read file; do
  if "$bin/realtime_probe" $how >"$scratch/probe.log" 2>&1 || ! grep -q 'RealtimeSanitizer: unsafe-library-call' "$scratch/probe.log"; then
    cat "$scratch/probe.log" >&2
    echo "rtsan: the rule was broken ($how) and the sanitizer let it pass" >&2
    exit 1
  fi
done
for how in allowed outside suspended; do
  "$bin/realtime_probe" $how >"$scratch/probe.log" 2>&1 || { cat "$scratch/probe.log" >&2; echo "rtsan: $how was stopped" >&2; exit 1; }
done
echo "rtsan: broken on purpose in 6 ways, stopped each time"
