#!/usr/bin/env bash
# Builds the documentation site into .pose/site; warnings, such as broken links, are errors. It has
# its own environment, since nothing else needs its packages.
#
# usage: scripts/build_site.sh [serve]      serve: at http://127.0.0.1:8000, rebuilt at each change
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

cd "$POSE_ROOT"
venv="$POSE_HOME/site_venv"
if ! [ -x "$venv/bin/uv" ]; then
    mkdir -p "$POSE_HOME"
    python3 -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        --require-hashes -r requirements/installer.txt
fi
"$venv/bin/uv" pip install --quiet --python "$venv/bin/python" --require-hashes -r requirements/site.txt
export NO_MKDOCS_2_WARNING=1 DISABLE_MKDOCS_2_WARNING=true
case "${1:-build}" in
    serve) exec "$venv/bin/mkdocs" serve --dev-addr 127.0.0.1:8000 ;;
    build) exec "$venv/bin/mkdocs" build --strict --clean ;;
    *) echo "error: usage: scripts/build_site.sh [serve]" >&2; exit 2 ;;
esac
