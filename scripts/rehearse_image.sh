#!/usr/bin/env bash
# Walks through the Dockerfile's steps without a container engine: the system step as root, then the
# build as the image's own user, in a scratch copy of the committed files.
#
# usage: scripts/rehearse_image.sh        as root, on a machine that may be changed, such as CI's
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
uid=10001

if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
    echo "error: found no root on a Debian or Ubuntu: the image's system step needs both" >&2
    exit 1
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
chmod 755 "$scratch"
git -C "$root" archive --prefix=pose_fusion/ HEAD | tar -x -C "$scratch"

"$scratch/pose_fusion/scripts/docker_system.sh" "$uid" "$scratch/pose_fusion" "$scratch/recordings"
home="$(getent passwd "$uid" | cut -d: -f6)"
# The image's Python is the system's, and nothing of the caller's ROS is there; but how the network
# is reached (proxies, certificates) stays.
as_image_user() {
    runuser -u "$(id -un "$uid")" -- env -u POSE_HOME -u UV_CACHE_DIR -u VIRTUAL_ENV -u AMENT_PREFIX_PATH \
        -u CMAKE_PREFIX_PATH -u LD_LIBRARY_PATH -u PYTHONPATH -u _ROS_WHEELS_BOOTSTRAP_COMPLETE \
        HOME="$home" POSE_PYTHON=/usr/bin/python3 PATH=/usr/local/bin:/usr/bin:/bin "$@"
}
as_image_user "$scratch/pose_fusion/pose" build
as_image_user "$scratch/pose_fusion/pose" up fusion.launch.yaml --print "bag:=$scratch/recordings/bag"
as_image_user test -w "$scratch/recordings"
echo "the image's steps work"
