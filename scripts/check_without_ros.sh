#!/usr/bin/env bash
# Installs the core, and what reads and calibrates recordings, in an empty virtual environment
# without ROS, and fuses a recording of two synthetic Kinects there: the README's example.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"
cd "$POSE_ROOT"

folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
./pose run pose_sim generate -o "$folder/session" --duration 20
{ read -r _ && read -r python; } <"$POSE_HOME/python"

# Elsewhere: setuptools builds beside the sources.
packages=()
for package in pose_core pose_io pose_calibration; do
    cp -rL "src/$package" "$folder/$package"
    packages+=("$folder/$package")
done
"$POSE_VENV/bin/uv" venv --quiet --python "$python" "$folder/venv"
"$POSE_VENV/bin/uv" pip install --quiet --python "$folder/venv/bin/python" "${packages[@]}"

# Without this shell's environment; kernels without optimisation compile in half the time, but some
# cannot be cached then, and numba warns of it.
env -i HOME="$folder" MPLBACKEND=Agg NUMBA_OPT=0 \
    PYTHONWARNINGS="ignore:Cannot cache compiled function" "$folder/venv/bin/python" \
    examples/fuse_csv.py "$folder/session/kinects.csv" "$folder/angles.png" | tee "$folder/said"
grep -qE '^[0-9]{3,} poses, 27 degrees of freedom$' "$folder/said"
grep -qE '^left_knee_flexion: .* to [6-9][0-9]\.[0-9] deg, stddev [1-9]\.[0-9] deg$' "$folder/said"
[ -s "$folder/angles.png" ]
