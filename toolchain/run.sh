#!/usr/bin/env bash
# Sets everything up and runs the main job: the controller, as it is deployed, measures a simulated plate in real time.
# The scanner is a TCP server on loopback, the robot a pseudo-terminal; the run folder is left in out/.
#
#     ./toolchain/run.sh [options of moldloft-sim devices, such as --plate dome --seed 7]
set -euo pipefail
cd "$(dirname "$0")/.."

toolchain/setup.sh
cmake --preset release >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
rm -f build-configure.log
cmake --build --preset release --target moldloft moldloft-sim pty_modem

bin=build/release/bin
out=out/run-$(date +%Y%m%d-%H%M%S)
mkdir -p out
scratch=$(mktemp -d)
devices=
cleanup() {
  if [ -n "$devices" ]; then kill "$devices" 2>/dev/null || true; wait "$devices" 2>/dev/null || true; fi
  rm -rf "$scratch"
}
trap cleanup EXIT

# The devices say on which port they listen and where a configuration that fits them lies.
"$bin/moldloft-sim" devices --scanner-port 0 --robot-pty "$scratch/robot" --cell "$scratch/cell.toml" --seed 1 "$@" \
  >"$scratch/devices.log" 2>&1 &
devices=$!
for _ in $(seq 100); do
  grep -q '^ready' "$scratch/devices.log" && break
  kill -0 "$devices" 2>/dev/null || { cat "$scratch/devices.log" >&2; devices=; exit 1; }
  sleep 0.1
done
grep '^ready' "$scratch/devices.log" || { echo "run: the simulated devices did not come up" >&2; cat "$scratch/devices.log" >&2; exit 1; }

# A pseudo-terminal lacks the modem lines that the serial library asks for; the preloaded library answers for it. On a
# real serial port the program runs without.
LD_PRELOAD=$PWD/build/release/lib/libpty_modem.so "$bin/moldloft" run "$scratch/cell.toml" --out "$out"
"$bin/moldloft-sim" judge "$out" --seed 1 "$@"
