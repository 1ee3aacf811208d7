#!/usr/bin/env bash
# The Debian package for 64-bit Arm, cross-built, and the tests under qemu-user. Leaves build/aarch64/moldloft_*_arm64.deb.
# Not part of continuous integration: an emulated processor takes many times as long.
#
#     toolchain/aarch64/build.sh [TEST PROGRAMS...]       default: test_hal test_tasks test_firmware_like test_host_sim
set -euo pipefail
cd "$(dirname "$0")/../.."

toolchain/setup.sh --aarch64
toolchain/aarch64/sysroot.sh
tests=("$@")
[ ${#tests[@]} -gt 0 ] || tests=(test_hal test_tasks test_firmware_like test_host_sim)

cmake --preset aarch64 -D MOLDLOFT_TESTS=ON -D MOLDLOFT_GEOMETRY_ONLY=OFF >/dev/null
cmake --build --preset aarch64 --target moldloft "${tests[@]}"
(cd build/aarch64 && DPKG_ADMINDIR=$PWD/../aarch64-sysroot/var/lib/dpkg cpack -B . | grep generated)
depends=$(dpkg-deb -f build/aarch64/moldloft_*_arm64.deb Depends)
[[ $depends == *libc6* ]] || { echo "aarch64: the package names no libraries that it needs: '$depends'" >&2; exit 1; }
echo "depends: $depends"

# Programs that start programs (the deployed controller on real links) need the kernel to run arm64 files by itself:
# qemu-user-static registers that. Without it those cases fail here and say so.
failed=0
for test in "${tests[@]}"; do
  echo "== $test"
  qemu-aarch64 -L build/aarch64-sysroot "build/aarch64/bin/$test" || failed=1
done
exit $failed
