#!/usr/bin/env bash
# Takes the pictures of the viewer in the documentation from a real run: the synthetic subject's
# devices, the live graph, a headless browser; then the recording that the run left.
#
# usage: scripts/take_screenshots.sh [--choreography NAME] [--output FOLDER] …   (--help)
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh" --develop
enter_workspace
cd "$POSE_ROOT"
PYTHONPATH="tests/support${PYTHONPATH:+:$PYTHONPATH}" exec python scripts/take_screenshots.py "$@"
