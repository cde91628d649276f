#!/usr/bin/env bash
# Run as the image's user: builds the workspace for its services, compiles the estimator's kernels
# into NUMBA_CACHE_DIR (a volume: another processor compiles its own there).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

options=()
[ ! -f "$POSE_ROOT/requirements/teleop.in" ] || options+=(--teleop)
"$POSE_ROOT/scripts/prepare.sh" "${options[@]}"
