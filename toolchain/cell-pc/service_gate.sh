#!/usr/bin/env bash
# The package installed, run and removed under systemd on the emulated cell PC, and check_service.py on what it leaves.
# Arguments go to run.sh.
#
#     toolchain/cell-pc/service_gate.sh [--build DIR]
set -euo pipefail
cd "$(dirname "$0")/../.."

toolchain/cell-pc/run.sh --out build/cell-pc/service --jobs service "$@"
toolchain/cell-pc/check_service.py build/cell-pc/service
