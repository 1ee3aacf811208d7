#!/usr/bin/env bash
# Sets everything up and runs the main job: the controller, as it is deployed, measures a simulated plate in real time.
# The scanner is a TCP server on loopback, the robot a pseudo-terminal; the run folder is left in out/.
#
#     ./toolchain/run.sh [options of moldloft-sim devices, such as --plate dome --seed 7]
#     ./toolchain/run.sh --resume out/run-...
set -euo pipefail
cd "$(dirname "$0")/.."

# Two that begin together build one after the other: ninja does not guard its folder.
mkdir -p build
exec {turn}>build/run.lock
flock --nonblock $turn || { echo "run.sh: another one builds here; waiting for it"; flock $turn; }
toolchain/setup.sh
cmake --preset release --log-level=WARNING >/dev/null
cmake --build --preset release --target moldloft moldloft-sim pty_modem
exec {turn}>&-

export MOLDLOFT_PROGRAMS=$PWD/build/release/bin MOLDLOFT_SHIM=$PWD/build/release/lib/libpty_modem.so
export MOLDLOFT_REHEARSE=./toolchain/run.sh
exec toolchain/package/moldloft-rehearse "$@"
