#!/usr/bin/env bash
# Runs the Dockerfile's steps without a container engine: the system step as root, then the build as
# the image's user, in a scratch copy of the committed files.
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

"$scratch/pose_fusion/scripts/docker_system.sh" "$uid" "$scratch"/{pose_fusion,recordings,kernels}
home="$(getent passwd "$uid" | cut -d: -f6)"
# The image uses the system's Python, without the caller's ROS; the network settings (proxies,
# certificates) are kept.
as_image_user() {
    runuser -u "$(id -un "$uid")" -- env -u POSE_HOME -u UV_CACHE_DIR -u VIRTUAL_ENV -u AMENT_PREFIX_PATH \
        -u CMAKE_PREFIX_PATH -u LD_LIBRARY_PATH -u PYTHONPATH -u _ROS_WHEELS_BOOTSTRAP_COMPLETE \
        HOME="$home" POSE_PYTHON=/usr/bin/python3 PATH=/usr/local/bin:/usr/bin:/bin "$@"
}
as_image_user NUMBA_CACHE_DIR="$scratch/kernels" "$scratch/pose_fusion/scripts/docker_build.sh"

# As in compose.yaml: the checkout is read-only, the page is on the loopback address. It must start,
# and end without error on a signal.
as_service() {
    # shellcheck disable=SC2016 # the inner bash expands them
    unshare --mount bash -c 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"' \
        "$scratch/pose_fusion" "${@}"
}
as_image_user test -w "$scratch/recordings"
run_service() {
    export -f as_image_user
    export uid home
    as_service bash -c 'as_image_user "$@"' as_image_user NUMBA_CACHE_DIR="$scratch/kernels" \
        ROS_LOG_DIR=/tmp/pose_log timeout --preserve-status -s INT 30 "$scratch/pose_fusion/pose" "$@"
}
run_service up fusion.launch.yaml "bag:=$scratch/recordings/bag" 2>&1 | tee "$scratch/said"
if grep -q "first start: compiling" "$scratch/said"; then
    echo "error: the service compiles the kernels that the build has compiled" >&2
    exit 1
fi
run_service up view.launch.yaml compare:=false page_port:=0
echo "the image's steps work"
