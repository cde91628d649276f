#!/usr/bin/env bash
# Pins and hashes what requirements/*.in name, for Python 3.10 to 3.13; beside an installed ROS, for its
# Python 3.12. What is pinned already stays
# as it is, unless --upgrade or --upgrade-package NAME asks for more.
#
# usage: scripts/lock_requirements.sh [option of `uv pip compile` …]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

cd "$POSE_ROOT/requirements"
lock() {
    local name="$1"
    shift
    "$POSE_VENV/bin/uv" pip compile --quiet --generate-hashes --no-header --no-annotate \
        "$name.in" -o "$name.txt" "$@"
}
compile() { lock "$@" --universal --python-version 3.10; }
compile installer "$@"
compile python "$@"
compile develop -c python.txt "$@"
compile ros-wheels -c python.txt -c develop.txt "$@"
compile site "$@"
lock installed-ros --python-version 3.12 "$@"
if [ -f teleop.in ]; then compile teleop -c python.txt -c develop.txt "$@"; fi
