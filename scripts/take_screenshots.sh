#!/usr/bin/env bash
# Takes the documentation's screenshots of the viewer from a real run of the synthetic subject's
# devices, the live graph and a headless browser; then from the run's recording.
#
# usage: scripts/take_screenshots.sh [--choreography NAME] [--output FOLDER] …   (--help)
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh" --develop
enter_workspace
cd "$POSE_ROOT"
PYTHONPATH="tests/support${PYTHONPATH:+:$PYTHONPATH}" exec python scripts/take_screenshots.py "$@"
