#!/usr/bin/env bash
# Installs what building needs, as packages of the distribution (Debian 12 or later); with --tests also what only some
# tests ask for, with --aarch64 the cross compiler and the emulator that toolchain/aarch64/build.sh asks for. Nothing is done
# when all of it is there. Needs root or sudo only when something is missing.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config git
  libeigen3-dev libasio-dev libserialport-dev libsqlite3-dev libfmt-dev libsystemd-dev
  libcli11-dev libtomlplusplus-dev nlohmann-json3-dev doctest-dev
  file dpkg-dev  # cpack asks the one what a file is, the other which packages the program needs
)
wanted=()  # of the distribution's list of packages, without being installed
if [ "${1-}" = --tests ]; then
  # OpenCASCADE, which reads our STEP and IGES files back: 180 MiB where X11 is there already, 384 MB on an empty system.
  # Where it is missing its tests are left out of the build, nothing else changes.
  packages+=(libocct-data-exchange-dev)
  # Clang, whose checks prove that the control thread does not wait: 50 MiB to fetch, 280 MiB installed.
  packages+=(clang-22 libclang-rt-22-dev)
  # The Debian packages: their units checked by systemd, all of them by lintian, and the README's way to them walked in a clean
  # Debian that debootstrap makes and systemd-nspawn boots.
  packages+=(systemd lintian debootstrap systemd-container)
  # The emulated cell PC, whose kernel is taken out of its package and which runs systemd and udev as they are here.
  packages+=(udev python3 cpio busybox-static rt-tests qemu-system-x86)
  [ "$(dpkg --print-architecture)" = amd64 ] && wanted+=(linux-image-rt-amd64)
fi
[ "${1-}" = --aarch64 ] && packages+=(g++-aarch64-linux-gnu qemu-user)

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
for package in "${wanted[@]}"; do
  apt-cache show "$package" >/dev/null 2>&1 || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: missing ${missing[*]}; run as root or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
installable=()
for package in "${missing[@]}"; do
  [[ " ${wanted[*]} " == *" $package "* ]] && continue
  # Only the emulator may be lacking: the tests on it then say that they are skipped.
  [ "$package" = qemu-system-x86 ] && ! apt-cache show "$package" >/dev/null 2>&1 && continue
  installable+=("$package")
done
[ ${#installable[@]} -eq 0 ] && exit 0
echo "setup: installing ${installable[*]}"
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${installable[@]}" >/dev/null
