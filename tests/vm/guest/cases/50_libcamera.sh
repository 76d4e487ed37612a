# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# A camera by libcamera through posed, with depth from a V4L2 camera that has a calibration of its own.

# write_libcamera_config: what libcamera makes of vimc's 640 columns is 636.
write_libcamera_config() {
  local calibration=/usr/share/posed/cameras/synthetic_vga.toml
  sed 's/^depth_units_per_metre.*/depth_units_per_metre = 32000.0/' $calibration >depth.toml
  sed 's/^width.*/width = 636/; s/^cx.*/cx = 317.5/' $calibration >camera.toml
  {
    cat
    cat <<'END'
[source]
kind = "libcamera"

[source.depth]
device = "/dev/video0"
format = "y16"
calibration = "depth.toml"
controls = ["test_pattern=6"]

[source.live]
rate_hz = 10.0
max_stamp_difference_s = 0.2

[camera]
calibration = "camera.toml"
END
  } | write_config
}

plug_both() {
  load_vivid n_devs=1 node_types=0x1
  modprobe vimc
  udevadm settle
}

# Frames of libcamera's camera and a V4L2 depth camera, whose depth is registered to colour.
case_libcamera_streams() {
  plug_both
  write_libcamera_config </dev/null
  start_posed
  expect_poses 5
  end_posed
}

# A camera that is named, and one that is not there: told by name, and waited for.
case_libcamera_named() {
  plug_both
  printf '[source.libcamera]\ncamera = "platform/vimc.0 Sensor B"\n' | write_libcamera_config
  start_posed
  expect_poses 3
  end_posed
  printf '[source.libcamera]\ncamera = "Sensor Z"\n' | write_libcamera_config
  start_posed
  expect_log 'source: .*Sensor Z'
  end_posed
}

# A size that the camera does not have is refused, with the one that it has.
case_libcamera_size_refused() {
  plug_both
  write_libcamera_config </dev/null
  sed -i 's/^width.*/width = 640/' camera.toml
  start_posed
  expect_log 'source: .*636x480'
  end_posed
}

# The camera is not there at the start, and plugged in later.
case_libcamera_plugged_late() {
  load_vivid n_devs=1 node_types=0x1
  write_libcamera_config </dev/null
  start_posed
  expect_log 'source: no frames; waiting for the camera'
  modprobe vimc
  udevadm settle
  expect_log 'source: frames come'
  expect_poses 3
  end_posed
}

# The depth camera goes away while libcamera's camera streams, and comes back.
case_libcamera_depth_unplugged() {
  plug_both
  write_libcamera_config </dev/null
  start_posed
  expect_poses 3
  pass_log
  unplug_cameras
  expect_log 'source: no frames; waiting for the camera'
  pass_log
  plug_cameras_again
  expect_log 'source: frames come'
  expect_poses 3
  end_posed
}
