#!/usr/bin/env bash
# The geometry library and those of its tests that hand it data from outside, or read what it writes, under the address
# sanitizer, in a build of their own: what it reports is a defect of this project.
# (The preset `asan` builds every room so, with the undefined-behaviour sanitizer as well; that takes several times as long.)
#
#     ./toolchain/asan.sh [FOLDER OF THE BUILD, build/asan-geometry where none is given]
set -euo pipefail
cd "$(dirname "$0")/.."
built=${1:-build/asan-geometry}

suites='/(cad|edges)/|/heap_watch|/fit/(fit_surface|bezier_surface_fit|bspline_surface_fit|carrier|gauss_track)[.]'
suites+='|/inspection/(foot_point|localization)[.]'
cmake -S . -B "$built" -G Ninja -D MOLDLOFT_GEOMETRY_ONLY=ON -D MOLDLOFT_TESTS=ON -D MOLDLOFT_TOGETHER=ON \
  -D MOLDLOFT_GEOMETRY_SUITES="$suites" \
  -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_FLAGS_DEBUG="-O1 -g1" \
  -D CMAKE_CXX_FLAGS="-fsanitize=address -fno-omit-frame-pointer" >/dev/null
cmake --build "$built" --target test_geometry

ctest --test-dir "$built" -R '^geometry:' --no-tests=error --output-on-failure --parallel 2
