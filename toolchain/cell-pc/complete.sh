#!/usr/bin/env bash
# The emulated cell PC once: the whole cell has to complete under PREEMPT_RT with every real-time setting read back as
# wanted. Arguments go to run.sh.
set -euo pipefail
cd "$(dirname "$0")/../.."
toolchain/cell-pc/run.sh --out build/cell-pc/complete --jobs cyclictest,cell "$@"
toolchain/cell-pc/check.py --complete build/cell-pc/complete
