#!/usr/bin/env bash
# What the image needs of the system, run as root: packages beside those of ros:jazzy, and the user
# that the services run as, who may open serial devices and owns the checkout and the recordings.
#
# usage: scripts/docker_system.sh UID CHECKOUT RECORDINGS
set -euo pipefail

if [ $# -ne 3 ]; then
    echo "usage: scripts/docker_system.sh UID CHECKOUT RECORDINGS" >&2
    exit 2
fi

apt-get -o Acquire::Retries=3 update
apt-get -o Acquire::Retries=3 install --yes --no-install-recommends cmake g++ gcc make python3-venv
apt-get clean

getent passwd "$1" >/dev/null || useradd --create-home --uid "$1" --groups dialout pose
mkdir -p "$3"
chown -R "$1" "$2" "$3"
