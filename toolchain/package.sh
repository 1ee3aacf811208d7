#!/usr/bin/env bash
# Sets everything up and makes the Debian packages in build/release/: moldloft, moldloft-sim, libmoldloft-geometry-dev.
set -euo pipefail
cd "$(dirname "$0")/.."

toolchain/setup.sh
cmake --preset release --log-level=WARNING >/dev/null
cmake --build --preset release --target packaged
cd build/release
umask 022  # cpack gives it to the parts of a package, which would else depend on who builds
rm -f ./*.deb  # of other versions: what lies here is what was built
cpack
