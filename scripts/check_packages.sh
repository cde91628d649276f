#!/usr/bin/env bash
# Installs each package with its declared dependencies in its own virtual environment, imports all
# modules and runs each executable with --help.
#
# usage: scripts/check_packages.sh [PACKAGE …]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh"
exec "$POSE_VENV/bin/python" "$POSE_ROOT/scripts/check_packages.py" "$POSE_HOME" "$@"
