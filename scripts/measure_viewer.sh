#!/usr/bin/env bash
# Measures whether the page of a live graph runs smoothly: the synthetic subject's devices with nine
# IMUs, the graph, headless browsers that count what they receive and draw.
#
# usage: scripts/measure_viewer.sh [--browsers N …] [--seconds S] …   (--help)
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh" --develop
enter_workspace
cd "$POSE_ROOT"
PYTHONPATH="tests/support${PYTHONPATH:+:$PYTHONPATH}" exec python scripts/measure_viewer.py "$@"
