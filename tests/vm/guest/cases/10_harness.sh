# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# The simulated devices by tools that are not ours: what later cases stand on.

# vivid streams YUYV, NV12, RGB and 16-bit images of 640x480 to v4l2-ctl.
case_vivid_streams() {
  load_vivid n_devs=2 node_types=0x1,0x1
  local format
  for format in YUYV NV12 RGB3 'Y16 '; do
    set_format /dev/video1 "$format" 640 480
    v4l2-ctl -d /dev/video1 --get-fmt-video | grep -q "'$format'" || fail "vivid has no $format"
    v4l2-ctl -d /dev/video1 --stream-mmap=4 --stream-count=10 --stream-to=frames
    [ -s frames ] || fail "no frames of $format"
  done
}

# gpio-sim shows what gpioset drives, and gpioget reads what it pulls.
case_gpio_sim_lines() {
  plug_gpio
  gpioset -m signal "$gpio_chip" 0=1 &
  wait_until grep -qx 1 "$gpio_lines/sim_gpio0/value" || fail "the line that gpioset drives stays low"
  local level
  for level in up down up; do
    pull 3 $level
    [ "$(gpioget "$gpio_chip" 3)" = "$([ $level = up ] && echo 1 || echo 0)" ] || fail "gpioget does not see pull-$level"
  done
}

# vimc is a camera that libcamera lists and captures from.
case_vimc_captures() {
  modprobe vimc
  udevadm settle
  cam --list | grep -q vimc || fail "libcamera does not list vimc"
  cam --camera 1 --stream role=viewfinder,width=640,height=480 --capture=3 --file=frame-#
  compgen -G 'frame-*' >/dev/null || fail "no frames"
}
