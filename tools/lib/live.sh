#!/bin/bash
# live.sh BIN CONFIG FOLDER: runs the daemon of BIN with CONFIG until its source ends, and `posectl watch` beside it as a second process that
# subscribes to the poses. Leaves posed.log, watch.log and received.csv in FOLDER. tools/demo calls it, where need be in a network of its own.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
source tools/lib/setup.sh
bin=$1 config=$2 folder=$3
url=$(sed -n 's/^url = "\(.*\)"$/\1/p' "$config")

start_child "$bin/tools/posectl/posectl" watch --url "$url" --csv "$folder/received.csv" >"$folder/watch.log" 2>&1
watch=$child
for _ in {1..50}; do # until it has subscribed
  ! grep -q '^watching' "$folder/watch.log" || break
  sleep 0.1
done

start_child show_progress "$folder/watch.log" 5
status=0
"$bin/daemon/posed" --config "$config" --exit-at-end >"$folder/posed.log" 2>&1 || status=$?
end_child "$child"
sleep 1 # what was published last is still on its way
end_child "$watch"
if [ "$status" -ne 0 ]; then
  tail -n 5 "$folder/posed.log" >&2
fi
exit "$status"
