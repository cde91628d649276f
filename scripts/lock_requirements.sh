#!/usr/bin/env bash
# Pins and hashes what requirements/*.in name, for Python 3.10 to 3.13. What is pinned already stays
# as it is, unless --upgrade or --upgrade-package NAME asks for more.
#
# usage: scripts/lock_requirements.sh [option of `uv pip compile` …]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

cd "$POSE_ROOT/requirements"
compile() {
    local name="$1"
    shift
    "$POSE_VENV/bin/uv" pip compile --quiet --universal --python-version 3.10 --generate-hashes \
        --no-header --no-annotate "$name.in" -o "$name.txt" "$@"
}
compile python "$@"
compile develop -c python.txt "$@"
compile ros-wheels -c python.txt -c develop.txt "$@"
compile site "$@"
if [ -f teleop.in ]; then compile teleop -c python.txt -c develop.txt "$@"; fi
