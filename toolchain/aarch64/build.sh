#!/usr/bin/env bash
# The Debian package for 64-bit Arm, cross-built, and the tests under qemu-user. Leaves build/aarch64/moldloft_*_arm64.deb.
# Not part of continuous integration: an emulated processor takes many times as long.
#
#     toolchain/aarch64/build.sh [TEST PROGRAMS...]       default: all but those that need OpenCASCADE or a preload
set -euo pipefail
cd "$(dirname "$0")/../.."

toolchain/setup.sh --aarch64
toolchain/aarch64/sysroot.sh
tests=("$@")
[ ${#tests[@]} -gt 0 ] || tests=(test_hal test_tasks test_geometry test_firmware_like test_host_sim)

# A test that starts a program asks this machine's kernel for it, which knows no arm64: under each program's name stands a
# script meanwhile that emulates it. The programs themselves are back in their places at the end.
bin=$PWD/build/aarch64/bin
put_back() {
  local program
  for program in "$bin"/*.arm64; do [ ! -e "$program" ] || mv "$program" "${program%.arm64}"; done
}
trap put_back EXIT
put_back  # after a run that was killed: what is built and packaged are the programs

cmake --preset aarch64 -D MOLDLOFT_TESTS=ON -D MOLDLOFT_GEOMETRY_ONLY=OFF >/dev/null
cmake --build --preset aarch64 --target packaged "${tests[@]}"
(cd build/aarch64 && DPKG_ADMINDIR=$PWD/../aarch64-sysroot/var/lib/dpkg cpack -B . | grep generated)
depends=$(dpkg-deb -f build/aarch64/moldloft_*_arm64.deb Depends)
[[ $depends == *libc6* ]] || { echo "aarch64: the package names no libraries that it needs: '$depends'" >&2; exit 1; }
echo "depends: $depends"

for program in moldloft moldloft-sim setup_probe serial_probe; do
  [ -e "$bin/$program" ] || continue
  mv "$bin/$program" "$bin/$program.arm64"
  printf '#!/bin/sh\nexec qemu-aarch64 -L %s %s "$@"\n' "$PWD/build/aarch64-sysroot" "$bin/$program.arm64" >"$bin/$program"
  chmod +x "$bin/$program"
done

# What says something about the emulator: it has a thread of its own in each process, does not tell a program that starts
# another why that failed, and holds memory that a limit on what may be locked does not foresee; and this machine's loader has
# its word on the preloaded arm64 library where one line is promised.
emulators="a cyclictest that is not there*,only the control thread is scheduled*,a program that was started under chrt*"
emulators+=",what the configuration does not ask for*,without rights nothing is had*,a finite limit on locked memory*"
emulators+=",a start pose off the plate and a plate that leaves*,plate after plate under one controller*"
failed=0
for test in "${tests[@]}"; do
  echo "== $test"
  qemu-aarch64 -L build/aarch64-sysroot "$bin/$test" "--test-case-exclude=$emulators" || failed=1
done
exit $failed
