#!/bin/bash
# usage: subscribers_test.sh BUILD_DIR: the examples of posed-dev build against what is installed, and understand a running daemon.
set -euo pipefail
build=$1
if [ "${2:-}" != inside ]; then
  unshare -rn sh -c 'ip link set lo up' 2>/dev/null || { echo "skipped: no network namespaces here"; exit 77; }
  exec unshare -rn "$0" "$build" inside
fi
ip link set lo up
ip link set lo multicast on
ip route add 224.0.0.0/4 dev lo
work=$(mktemp -d)
trap 'kill "$daemon" 2>/dev/null || true; rm -rf "$work"' EXIT
daemon=

DESTDIR=$work/root cmake --install "$build" --component dev >/dev/null
prefix=$(dirname "$(find "$work/root" -type d -path '*/include/posed-messages')")
prefix=${prefix%/include}
examples=$(find "$work/root" -type d -name examples)
cmake -S "$examples" -B "$work/build" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
cmake --build "$work/build" >/dev/null
(cd "$work" && lcm-gen --python --ppath . "$prefix"/share/posed/messages/*.lcm)
cp "$examples/subscriber.py" "$work/"

printf '[detector]\nenabled = false\n[dynamic]\nmode = "off"\n' > "$work/posed.toml"
"$build/daemon/posed" --config "$work/posed.toml" >"$work/log" 2>&1 &
daemon=$!
timeout 60 "$work/build/subscriber" 'udpm://239.255.76.67:7667?ttl=0' 5 | tee "$work/cpp"
timeout 60 python3 "$work/subscriber.py" 5 | tee "$work/python"
test "$(grep -c ' inliers$' "$work/cpp")" -ge 1
test "$(grep -c ' inliers$' "$work/python")" -ge 1
test "$(wc -l <"$work/cpp")" -eq 5
test "$(wc -l <"$work/python")" -eq 5
