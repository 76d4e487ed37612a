# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# GPIO lines through posed, on a simulated chip.

# write_gpio_config: lines 0 (status) and 3 (enable) of the chip labelled `robot`, with blinking that is soon seen.
write_gpio_config() {
  plug_cameras
  write_v4l2_config yuyv <<END
$squares

[gpio]
chip = "robot"
status_line = 0
enable_line = 3
waiting_ms = [200, 200]
initializing_ms = [200, 200]
tracking_ms = [200, 200]
lost_ms = [200, 200]
paused_ms = []
END
}

start_with_lines() {
  plug_gpio
  pull 3 up
  write_gpio_config
  start_posed
}

blinks() { [[ $(levels_of 0 2) == *0101* ]]; }
expect_blinking() { wait_until blinks || fail "the light does not blink"; }

# The status line blinks while posed runs, and is given back at its end.
case_gpio_status_blinks() {
  start_with_lines
  expect_blinking
  gpioinfo "$gpio_chip" | grep -E 'line +0:' | grep -q posed || fail "the line is not marked as posed's"
  end_posed
  gpioinfo "$gpio_chip" | grep -E 'line +0:' | grep -q unused || fail "the line is still taken"
}

# While the enable line is low no poses come and the light is as `paused_ms` says; when it is high again, poses come.
case_gpio_enable_pauses() {
  start_with_lines
  expect_poses 3
  pull 3 down
  expect_log 'paused by the enable line'
  sleep 1 # what was on its way
  timeout --signal=INT 15 posectl watch --csv paused.csv || true
  [ "$(count_rows paused.csv)" -eq 0 ] || fail "poses come while it is paused"
  [ "$(levels_of 0 2)" = 0 ] || fail "the light is not off"
  pull 3 up
  expect_log 'running: the enable line is active'
  expect_poses 3
  expect_blinking
  end_posed
}

# A chip that is pulled out is told in the log and posed runs on; plugged in again, its line is worked again. The line is an output: the
# simulated chip frees its interrupts while an input still has them, and the kernel breaks.
case_gpio_chip_removed() {
  plug_gpio
  write_gpio_config
  sed -i '/^enable_line/d' case.toml
  start_posed
  expect_blinking
  unplug_gpio
  expect_log 'gpio: waiting for a line'
  expect_poses 3
  plug_gpio
  expect_log 'gpio: every line is held'
  expect_poses 3
  expect_blinking
  end_posed
}

# A chip that is not there yet is waited for: posed starts, paused for want of its enable line, and runs when the chip comes.
case_gpio_chip_late() {
  write_gpio_config
  start_posed
  expect_log 'gpio: waiting for a line'
  plug_gpio
  pull 3 up
  expect_log 'running: the enable line is active'
  expect_poses 3
  end_posed
}

# A line that another program holds is named in the log with what is wrong, and posed runs on.
case_gpio_line_taken() {
  plug_gpio
  pull 3 up
  gpioset -m signal "$gpio_chip" 0=0 &
  wait_until bash -c "gpioinfo $gpio_chip | grep -E 'line +0:' | grep -q gpioset" || fail "gpioset does not take the line"
  write_gpio_config
  start_posed
  expect_log 'gpio: .*line 0 of .*busy'
  expect_poses 3
  end_posed
}
