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
. toolchain/devices.sh
start_devices "$bin/moldloft-sim" "$@"

# A pseudo-terminal lacks the modem lines that the serial library asks for; the preloaded library answers for it. On a
# real serial port the program runs without.
LD_PRELOAD=$PWD/build/release/lib/libpty_modem.so "$bin/moldloft" run "$scratch/cell.toml" --out "$out"
"$bin/moldloft-sim" judge "$out" --seed 1 "$@"
