#!/usr/bin/env bash
# Measures the frame rate of a live graph's page with the synthetic subject's devices, nine IMUs and
# headless browsers that count received and drawn frames.
#
# usage: scripts/measure_viewer.sh [--browsers N …] [--seconds S] …   (--help)
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh" --develop
enter_workspace
cd "$POSE_ROOT"
PYTHONPATH="tests/support${PYTHONPATH:+:$PYTHONPATH}" exec python scripts/measure_viewer.py "$@"
