#!/usr/bin/env bash
# The commit that a build is stamped with: in a repository, in a changed one, in a tarball, in no repository at all, in a
# folder of somebody else's repository; and nothing is compiled anew that did not change. Called with toolchain/build_info.cmake.
set -euo pipefail
script=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_NOSYSTEM=1
fail() { echo "build info: $1" >&2; exit 1; }
git_() { git -C "$tree" -c user.name=Loft -c user.email=loft@localhost "$@" >/dev/null; }
stamped() { cmake -D "SOURCE=$1" -D VERSION=1.2.3 -D "BUILD=Release, GNU" -D "OUT=$scratch/info.cpp" -P "${2:-$script}" && sed -n 's/.*info{"1.2.3", "\(.*\)", "Release, GNU"}.*/\1/p' "$scratch/info.cpp"; }
wants() { [ "$2" = "$3" ] || fail "$1: '$2', wanted '$3'"; }

tree=$scratch/tree
mkdir -p "$tree/toolchain" "$tree/inner"
cp "$script" "$tree/toolchain/build_info.cmake"
echo 'toolchain/build_info.cmake export-subst' >"$tree/.gitattributes"
echo one >"$tree/file"
wants "no repository" "$(stamped "$tree")" unknown
git_ init -q && git_ add . && git_ commit -q -m one
head=$(git -C "$tree" rev-parse HEAD)
wants "a repository" "$(stamped "$tree")" "${head:0:12}"
before=$(stat -c %y "$scratch/info.cpp")
stamped "$tree" >/dev/null
wants "the same commit again, the file's time" "$(stat -c %y "$scratch/info.cpp")" "$before"
echo new >"$tree/not_tracked"
wants "a file that is not tracked" "$(stamped "$tree")" "${head:0:12}"
echo two >"$tree/file"
wants "a changed tree" "$(stamped "$tree")" "${head:0:12}-dirty"
wants "a folder inside somebody's repository" "$(stamped "$tree/inner")" unknown
mkdir "$scratch/tarball"
git -C "$tree" archive HEAD | tar -x -C "$scratch/tarball"
wants "a tarball" "$(stamped "$scratch/tarball" "$scratch/tarball/toolchain/build_info.cmake")" "${head:0:12}"
