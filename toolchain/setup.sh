#!/usr/bin/env bash
# Installs what building needs, as packages of the distribution (Debian 12 or later); with --tests also what only some
# tests ask for. Nothing is done when all of it is there. Needs root or sudo only when something is missing.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config git
  libeigen3-dev libasio-dev libserialport-dev libsqlite3-dev libfmt-dev
  libcli11-dev libtomlplusplus-dev nlohmann-json3-dev doctest-dev
)
# OpenCASCADE, which reads our STEP and IGES files back: 180 MiB where X11 is there already, 384 MB on an empty system.
# Where it is missing its tests are left out of the build, nothing else changes.
# Clang, whose checks prove that the control thread does not wait: 50 MiB to fetch, 280 MiB installed.
[ "${1-}" = --tests ] && packages+=(libocct-data-exchange-dev clang-22 libclang-rt-22-dev)

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: missing ${missing[*]}; run as root or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
echo "setup: installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
