# shellcheck shell=bash
# The steps of tools/demo, which sources this after setup.sh and says where things are: bin, posectl, results, port, live_seconds.
# They leave what the table at the end shows in the arrays tracked, ate, track_ms, latency_ms, received; an index is a column.

# find_network: sets the array `network` to what must stand before a command so that it can use multicast: nothing where this machine has a
# route for it, else a network namespace of its own. Fails where neither can be had.
find_network() {
  network=()
  ip route get 239.255.76.67 >/dev/null 2>&1 && return
  local give_route='ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' namespace
  for namespace in "--net" "--user --map-root-user --net"; do
    # shellcheck disable=SC2206  # the options are words
    network=(unshare $namespace -- bash -c "$give_route" network)
    if "${network[@]}" true 2>/dev/null; then
      echo "    This machine has no multicast route: the processes run in a network of their own (unshare $namespace)."
      return
    fi
  done
  return 1
}

write_live_config() {
  cat >"$1" <<END
# Written by tools/demo.
[source]
kind = "synthetic"
pacing = "realtime"

[source.synthetic]
mode = "walking"
people = 2
seed = 1
rate_hz = 30.0
duration_s = $live_seconds.0

[camera]
calibration = "synthetic.toml"

[publisher]
url = "udpm://239.255.76.67:$port?ttl=0"
END
}

# show_live: the daemon in real time and a second process that counts. Sets live_* for the table.
show_live() {
  local network folder=$results/live
  say "Live: posed on the synthetic camera for $live_seconds s, 30 frames a second; posectl watch receives in another process"
  if ! find_network; then
    live_problem="not shown: this machine has no multicast route. Give it one, as root: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"
    echo "    $live_problem"
    return
  fi
  mkdir -p "$folder"
  rm -f "$folder"/*
  write_live_config "$folder/posed.toml"
  "${network[@]}" tools/lib/live.sh "$bin" "$folder/posed.toml" "$folder" ||
    fail "the live run failed" "Full output: $folder/posed.log, $folder/watch.log"
  local published received
  published=$(from_report 'poses published \([0-9]*\)' '\1')
  received=$(tail -n +2 "$folder/received.csv" | wc -l)
  echo "    published by posed: ${published:-0} poses; received by the other process: $received"
  if [ "${published:-0}" -eq 0 ] || [ "$published" -ne "$received" ]; then
    live_problem="posed published ${published:-0} poses, the other process received $received"
  fi
  live_tracked=$(from_report 'frames tracked \([0-9]*\), lost \([0-9]*\), not processed \([0-9]*\)' '\1 \2 \3' |
    awk '{ printf "%d of %d", $1, $1 + $2 + $3 }')
  live_track_ms=$(from_report '; track p50 \([0-9.]*\) ms p99 \([0-9.]*\) ms' '\1 / \2')
  live_latency_ms=$(from_report 'capture to publish p50 \([0-9.]*\) ms p99 \([0-9.]*\) ms' '\1 / \2')
  live_received="$received of $published"
}

# from_report PATTERN REPLACEMENT: from the daemon's last report in its log.
from_report() { grep 'poses published' "$results/live/posed.log" | tail -n 1 | sed -n "s|.*$1.*|$2|p"; }

# json_number FILE KEY [KEY]: a number of posectl's JSON, which has one key a line; the second key is looked for after the first.
json_number() {
  awk -v first="\"$2\":" -v second="\"${3:-}\":" '
    index($0, first) && second == "\"\":" { wanted = 1 }
    index($0, first) { inside = 1 }
    inside && second != "\"\":" && index($0, second) { wanted = 1 }
    wanted { value = $0; sub(/.*: /, "", value); sub(/,$/, "", value); print value; exit }' "$1"
}

# show_replay NAME TITLE GROUNDTRUTH FRAMES ARGUMENTS...: replays in lockstep, evaluates, and adds a column to the table. GROUNDTRUTH and FRAMES may
# be empty.
show_replay() {
  local name=$1 title=$2 truth=$3 frames=$4 folder=$results/$1
  shift 4
  mkdir -p "$folder"
  rm -f "$folder"/*.txt "$folder"/*.json
  run_step "Replay: $title" "demo-replay-$name.log" "By hand: $posectl replay --help" \
    "$posectl" replay "$@" --lockstep --trajectory "$folder/trajectory.txt" --online-trajectory "$folder/online.txt" --stats "$folder/stats.json"
  tracked[$name]="$(json_number "$folder/stats.json" tracked) of $(json_number "$folder/stats.json" frames)"
  track_ms[$name]=$(quantiles "$folder/stats.json" track_ms)
  ate[$name]=-
  if [ -n "$truth" ]; then
    run_step "Evaluate: $title" "demo-eval-$name.log" "By hand: $posectl eval $truth $folder/trajectory.txt" \
      "$posectl" eval "$truth" "$folder/trajectory.txt" ${frames:+--frames "$frames"} --json "$folder/error.json"
    ate[$name]=$(json_number "$folder/error.json" ate_rmse | awk '{ printf "%.4f", $1 }')
  fi
}

quantiles() { printf '%.1f / %.1f' "$(json_number "$1" "$2" p50)" "$(json_number "$1" "$2" p99)"; }

row() { printf '  %-34s' "$1"; shift; printf ' %18s' "$@"; echo; }

