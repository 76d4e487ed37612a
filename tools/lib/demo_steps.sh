# shellcheck shell=bash disable=SC2154,SC2034  # reads variables of tools/demo, and prints arrays by name
# The steps of tools/demo, which sources this after setup.sh and says where things are (bin, posectl, results) and how much to show (live_seconds,
# replay_seconds). Each step leaves its column of the table in the arrays below; what went wrong without ending the demonstration is in `problems`.

declare -A title received tracked ate track_ms latency_ms
columns=()
problems=()

readonly url="udpm://239.255.76.67:7668?ttl=0" # not LCM's usual port: a daemon at work on this machine is not to be disturbed

# find_network: sets the array `network` to what must stand before a command so that it can use multicast: nothing where this machine has a
# route for it, else a network namespace of its own. Fails where neither can be had.
find_network() {
  network=()
  ip route get 239.255.76.67 >/dev/null 2>&1 && return
  # shellcheck disable=SC2016  # expanded by the inner shell
  local give_route='ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' namespace
  for namespace in "--net" "--user --map-root-user --net"; do
    # shellcheck disable=SC2206  # the options are words
    network=(unshare $namespace -- bash -c "$give_route" network)
    if "${network[@]}" true 2>/dev/null; then
      echo "    This machine has no multicast route: the two processes run in a network of their own (unshare $namespace)."
      return
    fi
  done
  return 1
}

# write_config FILE SECONDS: the synthetic camera at 320x240 and two people who walk.
write_config() {
  cat >"$1" <<END
# Written by tools/demo.
[source]
kind = "synthetic"

[source.synthetic]
mode = "walking"
people = 2
seed = 1
rate_hz = 30.0
duration_s = $2.0

[camera]
calibration = "synthetic.toml"

[publisher]
url = "$url"
END
}

# from_report PATTERN REPLACEMENT: from the daemon's last report in its log.
from_report() { grep 'poses published' "$results/live/posed.log" | tail -n 1 | sed -n "s|.*$1.*|$2|p"; }

# show_live: the daemon in real time, and a second process that receives.
show_live() {
  local network=() folder=$results/live published not_processed
  say "Live: posed on the synthetic camera, 30 frames a second for $live_seconds s; posectl watch receives in another process"
  mkdir -p "$folder"
  rm -f "$folder"/*
  if ! find_network; then
    echo "    Not shown: LCM needs a multicast route, and there is none. Give this machine one, as root:"
    echo "      ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo"
    problems+=("the live part was not shown, for want of a multicast route")
    return
  fi
  write_config "$folder/posed.toml" "$live_seconds"
  "${network[@]}" tools/lib/live.sh "$bin" "$folder/posed.toml" "$folder" ||
    fail "step 'Live' failed" "Full output: $folder/posed.log and $folder/watch.log" "By hand: $bin/daemon/posed --config $folder/posed.toml"
  published=$(from_report 'poses published \([0-9]*\)' '\1')
  columns+=(live)
  title[live]="live, 30 Hz"
  received[live]="$(tail -n +2 "$folder/received.csv" | wc -l) of ${published:-0}"
  tracked[live]=$(from_report 'frames tracked \([0-9]*\), lost \([0-9]*\), not processed \([0-9]*\)' '\1 \2 \3' |
    awk '{ printf "%d of %d", $1, $1 + $2 + $3 }')
  not_processed=$(from_report 'not processed \([0-9]*\)' '\1')
  if [ "${not_processed:-0}" -gt 0 ]; then
    echo "    This machine was too busy for $not_processed of the frames: it renders them as well, which a real camera does for itself."
  fi
  track_ms[live]=$(from_report '; track p50 \([0-9.]*\) ms p99 \([0-9.]*\) ms' '\1 / \2')
  latency_ms[live]=$(from_report 'capture to publish p50 \([0-9.]*\) ms p99 \([0-9.]*\) ms' '\1 / \2')
  echo "    posed published ${published:-0} poses; received by the other process: ${received[live]}"
  [ "${received[live]}" = "$published of $published" ] || problems+=("the other process received only ${received[live]} poses")
}

# json_number FILE KEY [KEY]: a number of posectl's JSON, which has a key a line; the second key is inside of the first.
json_number() {
  awk -v outer="\"$2\":" -v inner="\"${3:-$2}\":" '
    index($0, outer) { inside = 1 }
    inside && index($0, inner) { sub(/.*: /, ""); sub(/,$/, ""); print; exit }' "$1"
}

quantiles() { printf '%.1f / %.1f' "$(json_number "$1" "$2" p50)" "$(json_number "$1" "$2" p99)"; }

# show_replay COLUMN TITLE TRUTH ARGUMENTS...: replays in lockstep what the arguments name, and compares with TRUTH where it exists.
show_replay() {
  local column=$1 truth=$3 folder=$results/$1
  title[$column]=$2
  shift 3
  mkdir -p "$folder"
  rm -f "$folder"/*.txt "$folder"/*.json
  run_step "Replay, every frame: ${title[$column]}" "demo-$column.log" "By hand: $posectl replay $*" \
    "$posectl" replay "$@" --lockstep --trajectory "$folder/trajectory.txt" --online-trajectory "$folder/online.txt" --stats "$folder/stats.json"
  columns+=("$column")
  tracked[$column]="$(json_number "$folder/stats.json" tracked) of $(json_number "$folder/stats.json" frames)"
  track_ms[$column]=$(quantiles "$folder/stats.json" track_ms)
  if [ -e "$truth" ]; then
    run_step "Compare with the true trajectory: ${title[$column]}" "demo-$column-eval.log" "By hand: $posectl eval $truth $folder/trajectory.txt" \
      "$posectl" eval "$truth" "$folder/trajectory.txt" --frames "${truth%/*}/rgb.txt" --json "$folder/error.json"
    ate[$column]=$(json_number "$folder/error.json" ate_rmse | awk '{ printf "%.4f", $1 }')
  fi
}

# show_synthetic_replay COLUMN TITLE PEOPLE: a way through the synthetic room, written as a recording with its true trajectory, and replayed.
show_synthetic_replay() {
  local recording=$results/recording-$1
  run_step "Write $replay_seconds s of the synthetic room, $2, as a recording" "demo-synth-$1.log" "By hand: $posectl synth --help" \
    "$posectl" synth --out "$recording" --force --seed 2 --mode walking --people "$3" --duration "$replay_seconds" --camera config/cameras/synthetic.toml
  show_replay "$1" "$2" "$recording/groundtruth.txt" --sequence "$recording" --camera "$recording/camera.toml"
}

# show_again NAME TITLE RECORDING OPTION...: the recording of an earlier show_synthetic_replay once more, with other options.
show_again() {
  local recording=$results/recording-$3
  show_replay "$1" "$2" "$recording/groundtruth.txt" --sequence "$recording" --camera "$recording/camera.toml" "${@:4}"
}

# print_row NAME VALUES: a line of the table; VALUES is the name of an array.
print_row() {
  local -n values=$2
  local column
  printf '  %-32s' "$1"
  for column in "${columns[@]}"; do
    printf ' %20s' "${values[$column]:--}"
  done
  echo
}

print_table() {
  echo
  print_row "" title
  print_row "frames tracked" tracked
  print_row "poses received" received
  print_row "ATE RMSE [m]" ate
  print_row "tracking p50 / p99 [ms]" track_ms
  print_row "capture to publish p50 / p99 [ms]" latency_ms
  echo
  echo "  People who walk through the picture are left out of the estimate; the last column shows what they do to it where they are not."
}
