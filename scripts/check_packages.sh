#!/usr/bin/env bash
# Installs each package in a virtual environment of its own, from what it declares alone, imports
# all of it and asks each executable for its help.
#
# usage: scripts/check_packages.sh [PACKAGE …]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

"$POSE_ROOT/scripts/prepare.sh"
exec "$POSE_VENV/bin/python" "$POSE_ROOT/scripts/check_packages.py" "$POSE_HOME" "$@"
