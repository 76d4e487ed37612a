# shellcheck shell=bash
# What the cases share. A case is a function case_NAME with a line before it that says what it shows; it runs in a process of its own with
# `set -e`, and ends by fail, skip, or a command that fails.
set -euo pipefail
trap 'echo "line $LINENO: $BASH_COMMAND" >>/run/reason' ERR
set -E

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

# wait_until SECONDS COMMAND...: true as soon as the command succeeds; false where it did not in that time.
wait_until() {
  local -r end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || return 1
    sleep 0.2
  done
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

# ---- Lines

readonly gpio_folder=/sys/kernel/config/gpio-sim/robot

# plug_gpio LINES: a simulated chip with that many lines; sets `gpio_chip`, and `gpio_lines` to the folder with a folder sim_gpioN a line.
plug_gpio() {
  modprobe gpio-sim
  mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config
  mkdir -p "$gpio_folder/bank0"
  echo "$1" >"$gpio_folder/bank0/num_lines"
  echo robot >"$gpio_folder/bank0/label"
  echo 1 >"$gpio_folder/live"
  udevadm settle
  gpio_chip=$(cat "$gpio_folder/bank0/chip_name")
  gpio_lines=/sys/devices/platform/$(cat "$gpio_folder/dev_name")/$gpio_chip
}

unplug_gpio() { echo 0 >"$gpio_folder/live"; }

# clean_up: after each case, whatever became of it.
clean_up() {
  trap - ERR
  set +e
  systemctl stop posed.service 2>/dev/null
  pkill -KILL -x posed
  pkill -KILL -x posectl
  pkill -KILL -x v4l2-ctl
  pkill -KILL -x 'gpioset|gpioget|gpiomon|cam'
  sleep 0.2
  if [ -d "$gpio_folder" ]; then
    unplug_gpio
    rmdir "$gpio_folder"/bank0/line* "$gpio_folder/bank0" "$gpio_folder" 2>/dev/null
  fi
  local module
  for module in gpio-sim vivid vimc v4l2loopback; do
    [ ! -d "/sys/module/${module//-/_}" ] || modprobe -r "$module"
  done
  rm -rf /run/case
  true
}
mkdir -p /run/case
cd /run/case
