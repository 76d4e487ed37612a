# shellcheck shell=bash disable=SC2034  # variables that the cases read
# What the cases share. A case is a function case_NAME with a line before it that says what it shows; it runs in a process of its own with
# `set -e`, and ends by fail, skip, or a command that fails.
set -euo pipefail
set -E
trap 'echo "line $LINENO: $BASH_COMMAND" >>/run/reason' ERR

fail() {
  echo "$*" | tee -a /run/reason
  trap - ERR
  exit 1
}

skip() {
  echo "$*" | tee -a /run/reason
  trap - ERR
  exit 77
}

show_logs() {
  local log
  for log in *.log; do
    [ ! -e "$log" ] || { echo "---- $log"; cat "$log"; }
  done
  echo "---- posed.service"
  journal_of_service
}

# journal_of_service: what the installed service and systemd have said of it since the case began.
case_began=$(date +%s)
journal_of_service() { journalctl --output=cat --no-pager --quiet --unit=posed.service --since="@$case_began"; }

trap show_logs EXIT

# No case tells a time: an emulated processor on a busy machine may take so long for what takes a moment elsewhere.
readonly patience_s=120

# wait_until COMMAND...: true as soon as the command succeeds; false where it does not.
wait_until() {
  local -r end=$((SECONDS + patience_s))
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || return 1
    sleep 0.2
  done
}

# ---- posed

# write_config: case.toml with what comes on standard input, and a small load.
write_config() {
  {
    cat
    cat <<'END'

[detector]
enabled = false

[dynamic]
mode = "off"

[tracker]
features = 300

[mapper]
bundle_keyframes = 0
loop_closing = false
END
  } >case.toml
}

# start_posed: with case.toml, in the background; returns when it runs.
start_posed() {
  : >posed.log
  log_seen=0
  posed --config case.toml >>posed.log 2>&1 &
  posed=$!
  expect_log 'running: '
}

# expect_log PATTERN: posed says so soon, or has said so since `pass_log` or its start.
expect_log() { wait_until logged "$1" || fail "posed does not log '$1'"; }
logged() { tail -n "+$((log_seen + 1))" posed.log | grep -E -- "$1"; }

# pass_log: what posed has said until now counts no longer.
pass_log() { log_seen=$(wc -l <posed.log); }

is_gone() { ! kill -0 "$1"; }

# end_posed: asks it to end; it must do so, and say that all is well.
end_posed() {
  kill -TERM "$posed"
  wait_until is_gone "$posed" || fail "posed does not end"
  local status=0
  wait "$posed" || status=$?
  [ "$status" -eq 0 ] || fail "posed ended with status $status"
}

# count_rows FILE: of a table with a heading; 0 where there is none.
count_rows() { tail -n +2 "$1" 2>/dev/null | wc -l; }

# expect_poses NUMBER: so many more messages with a pose, or without one while there is none, come from posed.
expect_poses() {
  rm -f poses.csv
  timeout "$patience_s" posectl watch --count "$1" --csv poses.csv || true # its status tells of gaps, which a slow machine has
  [ "$(count_rows poses.csv)" -ge "$1" ] || fail "posed does not publish $1 poses"
}

# ---- Cameras

# load_vivid OPTIONS...: simulated cameras as /dev/video0 and so on, with the first input, a webcam.
load_vivid() {
  modprobe vivid no_error_inj=0 "$@"
  udevadm settle
}

set_format() { # DEVICE FOURCC WIDTH HEIGHT
  v4l2-ctl -d "$1" --set-fmt-video="width=$3,height=$4,pixelformat=$2"
}

readonly color_node=/dev/video0
readonly depth_node=/dev/video1

# plug_cameras: two, with nodes of their own in one device.
plug_cameras() { load_vivid n_devs=2 node_types=0x1,0x1; }

unplug_cameras() { echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind; }

plug_cameras_again() {
  echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
  udevadm settle
}

# write_v4l2_config FORMAT [NODE]: colour in this format, many squares, and 16 bits of depth, white, which is 2 m. The two cameras run free
# of each other, so two images of one pair are up to half a period apart. What comes on standard input goes into the table source.v4l2.
write_v4l2_config() {
  sed 's/^depth_units_per_metre.*/depth_units_per_metre = 32000.0/' /usr/share/posed/cameras/synthetic_vga.toml >camera.toml
  {
    printf '[source.v4l2]\ndevice = "%s"\nformat = "%s"\n' "${2:-$color_node}" "$1"
    cat
    cat <<END

[source]
kind = "v4l2"

[source.depth]
device = "$depth_node"
format = "y16"
controls = ["test_pattern=6"]

[source.live]
rate_hz = 10.0
max_stamp_difference_s = 0.05

[camera]
calibration = "camera.toml"
END
  } | write_config
}

readonly squares='controls = ["test_pattern=4"]'

# ---- Lines

readonly gpio_folder=/sys/kernel/config/gpio-sim/robot

# plug_gpio: a simulated chip with eight lines, labelled `robot`; sets `gpio_chip`, and `gpio_lines` to the folder with a folder
# sim_gpioN a line.
plug_gpio() {
  modprobe gpio-sim
  mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config
  if [ ! -d "$gpio_folder" ]; then
    mkdir -p "$gpio_folder/bank0"
    echo 8 >"$gpio_folder/bank0/num_lines"
    echo robot >"$gpio_folder/bank0/label"
  fi
  echo 1 >"$gpio_folder/live"
  udevadm settle
  gpio_chip=$(cat "$gpio_folder/bank0/chip_name")
  gpio_lines=/sys/devices/platform/$(cat "$gpio_folder/dev_name")/$gpio_chip
}

# pull LINE up|down: what drives an input.
pull() { echo "pull-$2" >"$gpio_lines/sim_gpio$1/pull"; }

# levels_of LINE SECONDS: the levels that it takes in this time, one digit each change.
levels_of() {
  local -r end=$((SECONDS + $2))
  local level last=''
  while [ "$SECONDS" -lt "$end" ]; do
    read -r level <"$gpio_lines/sim_gpio$1/value"
    [ "$level" = "$last" ] || printf %s "$level"
    last=$level
    sleep 0.05
  done
}

unplug_gpio() { echo 0 >"$gpio_folder/live"; }

# clean_up: after each case, whatever became of it.
clean_up() {
  trap - ERR EXIT
  set +e
  systemctl kill --signal=KILL posed.service posed-case.service 2>/dev/null
  systemctl stop posed.service posed-case.service 2>/dev/null # it would be restarted
  systemctl reset-failed posed.service posed-case.service 2>/dev/null
  local program
  for program in posed posectl v4l2-ctl cam gpioset gpiomon; do
    pkill -KILL -x "$program"
  done
  sleep 0.2
  if [ -d "$gpio_folder" ]; then
    unplug_gpio
    rmdir "$gpio_folder"/bank0/line* "$gpio_folder/bank0" "$gpio_folder" 2>/dev/null
  fi
  local module
  for module in gpio-sim vivid vimc v4l2loopback; do
    [ ! -d "/sys/module/${module//-/_}" ] || modprobe -r "$module"
  done
  rm -rf /run/systemd/system/posed.service.d
  systemctl daemon-reload
  umount /run/case/disk 2>/dev/null
  rm -rf /run/case
  rm -f /var/lib/posed/*
}
mkdir -p /run/case
cd /run/case
