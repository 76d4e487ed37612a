#!/bin/bash
# usage: unit_test.sh BUILD_DIR: the installed unit is valid, and exposes at most 1.5 (of 10) by systemd's own measure.
set -euo pipefail
build=$1
command -v systemd-analyze >/dev/null || { echo "skipped: there is no systemd-analyze"; exit 77; }
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
DESTDIR=$stage cmake --install "$build" --component daemon >/dev/null
unit=$(find "$stage" -name posed.service)
test -n "$unit" || { echo "no posed.service is installed"; exit 1; }

systemd-analyze security --offline=true --threshold=15 "$unit" | tail -1

# `verify` looks for the program and for the units around it in the root it is given; the manual page is gzipped there.
mkdir -p "$stage/etc/systemd/system" "$stage/lib/systemd/system"
cp "$unit" "$stage/etc/systemd/system/posed.service"
mkdir -p "$stage/bin" && cp /bin/kill "$stage/bin/"
cp -r /lib/systemd/system/. "$stage/lib/systemd/system/"
if ! output=$(systemd-analyze verify --man=no --recursive-errors=no --root="$stage" posed.service 2>&1) || [ -n "$output" ]; then
  echo "systemd-analyze verify: $output"
  exit 1
fi
echo "verify: clean"
