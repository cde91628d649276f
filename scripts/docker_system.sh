#!/usr/bin/env bash
# Run as root: installs system packages besides those of ros:jazzy, and creates the user of the
# services, who may open serial devices and owns the given folders, which are created if missing.
#
# usage: scripts/docker_system.sh UID FOLDER …
set -euo pipefail

if [ $# -lt 2 ]; then
    echo "usage: scripts/docker_system.sh UID FOLDER …" >&2
    exit 2
fi
uid="$1"
shift

apt-get -o Acquire::Retries=3 update
apt-get -o Acquire::Retries=3 install --yes --no-install-recommends cmake g++ gcc make python3-venv
apt-get clean

getent passwd "$uid" >/dev/null || useradd --create-home --uid "$uid" --groups dialout pose
mkdir -p "$@"
chown -R "$uid" "$@"
