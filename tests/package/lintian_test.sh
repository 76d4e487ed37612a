#!/bin/bash
# usage: lintian_test.sh BUILD_DIR: the Debian packages can be made, and lintian finds nothing in them.
set -euo pipefail
build=$1
command -v lintian >/dev/null || { echo "skipped: there is no lintian"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
(cd "$build" && cpack -G DEB -B "$work") >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
ls "$work"/*.deb
test "$(ls "$work"/*.deb | wc -l)" -eq 3
lintian --allow-root --fail-on error,warning --tag-display-limit 0 "$work"/*.deb
