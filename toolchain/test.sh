#!/usr/bin/env bash
# Sets everything up, builds, and passes the tests. Arguments go to ctest, such as -R tracker.
set -euo pipefail
cd "$(dirname "$0")/.."

toolchain/setup.sh --tests
cmake --preset release >/dev/null
cmake --build --preset release
ctest --test-dir build/release --output-on-failure --parallel 2 "$@"
