#!/usr/bin/env bash
# Installs a headless Chromium for tests of pages, if there is none and system packages may be
# installed (root, apt). Otherwise those tests are skipped with the reason.
#
# POSE_BROWSER     the browser to use: then nothing is installed
#
# usage: scripts/install_browser.sh [--is-needed]     --is-needed only tells, by its exit code
set -euo pipefail

is_needed() {
    local browser
    for browser in ${POSE_BROWSER:-chromium-headless-shell chromium chromium-browser google-chrome}; do
        if command -v "$browser" >/dev/null; then return 1; fi
    done
    [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null
}

case "${1:-}" in
    "") ;;
    --is-needed) is_needed && exit || exit 1 ;;
    *)
        echo "usage: scripts/install_browser.sh [--is-needed]" >&2
        exit 2
        ;;
esac
is_needed || exit 0

export DEBIAN_FRONTEND=noninteractive
apt-get -o Acquire::Retries=3 update || true
# Debian has both; Ubuntu's package of the second name only points to snap.
for package in chromium-headless-shell chromium; do
    if apt-get -o Acquire::Retries=3 install --yes --no-install-recommends "$package" &&
        "$package" --version; then
        exit 0
    fi
done
echo "no browser could be installed: tests of pages will be skipped"
