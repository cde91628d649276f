#!/usr/bin/env bash
# Static checks: formatting, style, types, YAML, Dockerfile, shell scripts. All checks are run; the
# script fails at the end if one failed.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

if [ $# -gt 0 ]; then
    echo "usage: ./pose lint        checks formatting, style, types, YAML, Dockerfile, scripts"
    [ "$1" = --help ] || [ "$1" = -h ] || exit 2
    exit 0
fi

"$POSE_ROOT/scripts/prepare.sh" --develop
enter_workspace
cd "$POSE_ROOT"
failed=()

# check NAME COMMAND…
check() {
    local name="$1"
    shift
    printf '[lint] %s\n' "$name" >&2
    "$@" || failed+=("$name")
}

packages=()
for setup in src/*/setup.py; do
    package="$(dirname "$setup")"
    packages+=("$package/$(basename "$package")")
done
mapfile -d '' yaml_files < <(find src docker scripts -name '*.yaml' -print0)

check "ruff check" ruff check .
check "ruff format" ruff format --check .
check mypy mypy "${packages[@]}"
check "mypy --strict" mypy --strict --cache-dir .mypy_cache/strict src/pose_core/pose_core
check yamllint yamllint --strict -c scripts/yamllint.yaml "${yaml_files[@]}"
check hadolint hadolint -c scripts/hadolint.yaml docker/Dockerfile
check shellcheck shellcheck -x -P SCRIPTDIR pose .ci/run scripts/*.sh

if [ ${#failed[@]} -gt 0 ]; then
    printf 'error: failed: %s\n' "${failed[*]}" >&2
    exit 1
fi
