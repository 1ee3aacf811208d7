#!/usr/bin/env bash
# Unpacks what the controller includes and links, for arm64, into build/aarch64-sysroot, out of the distribution's own packages.
# No root, and nothing of this machine is changed: apt works on a state of its own beside it. build.sh calls this.
set -euo pipefail
cd "$(dirname "$0")/../.."

sysroot=$PWD/build/aarch64-sysroot
[ -f "$sysroot/.complete" ] && exit 0
packages=(
  libc6-dev libstdc++6 libfmt-dev libserialport-dev libsqlite3-dev libtomlplusplus-dev libsystemd-dev
  libeigen3-dev libasio-dev libcli11-dev nlohmann-json3-dev doctest-dev  # headers alone: a sysroot hides this machine's
)

apt=$sysroot.apt
rm -rf "$sysroot" "$apt"
mkdir -p "$sysroot/var/lib/dpkg/info" "$apt/lists/partial" "$apt/cache/archives/partial"
: >"$apt/status"
options=(-qq -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o APT::Sandbox::User="$(id -un)" -o Debug::NoLocking=1
  -o Dir::State="$apt" -o Dir::State::lists="$apt/lists" -o Dir::State::status="$apt/status" -o Dir::Cache="$apt/cache")
apt-get "${options[@]}" update
apt-get "${options[@]}" --yes --no-install-recommends --download-only install "${packages[@]}" >/dev/null

# dpkg's own notes on each package come along: from them dpkg-shlibdeps knows which package a library belongs to.
database=$sysroot/var/lib/dpkg
# Notes of a package that may be there for several architectures carry this one in their name: format 1.
echo 1 >"$database/info/format"
for package in "$apt"/cache/archives/*.deb; do
  dpkg-deb -x "$package" "$sysroot"
  name=$(dpkg-deb -f "$package" Package)
  [ "$(dpkg-deb -f "$package" Multi-Arch)" = same ] && name=$name:arm64
  { echo "Status: install ok installed"; dpkg-deb -f "$package"; echo; } >>"$database/status"
  notes=$apt/notes
  rm -rf "$notes" && dpkg-deb -e "$package" "$notes"
  for note in symbols shlibs; do
    [ -f "$notes/$note" ] && cp "$notes/$note" "$database/info/$name.$note"
  done
  (cd "$sysroot" && dpkg-deb --fsys-tarfile "$package" | tar -t | sed "s#^\.#$sysroot#; s#/\$##") >"$database/info/$name.list"
done
rm -rf "$apt"
touch "$sysroot/.complete"
