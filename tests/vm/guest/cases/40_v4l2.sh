# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# V4L2 cameras through posed: colour from one simulated camera, depth from another. Both belong to one device, so they are plugged
# together.

# start_streaming: posed, with frames that come.
start_streaming() {
  plug_cameras
  write_v4l2_config yuyv <<<"$squares"
  start_posed
  expect_poses 3
}

expect_loss() {
  expect_log 'source: no frames; waiting for the camera'
  pass_log
}

# expect_return TIMES: frames come again, and at its end posed tells how often they did. (It says so at once only where they were away for
# long enough to be missed.)
expect_return() {
  expect_poses 3
  end_posed
  expect_log "camera back $1 times"
}

# Frames of two cameras, colour and depth, in each format that vivid and posed have, and in the one that posed takes by itself.
case_v4l2_formats() {
  plug_cameras
  local format
  for format in yuyv nv12 rgb24 bgr24 grey auto; do
    echo "---- $format"
    write_v4l2_config $format <<<"$squares"
    start_posed
    expect_poses 3
    expect_log 'state: tracking'
    end_posed
  done
}

# Both cameras are unplugged while they stream, and plugged in again.
case_v4l2_unplugged() {
  start_streaming
  pass_log
  unplug_cameras
  expect_loss
  sleep 2
  kill -0 "$posed" || fail "posed ended"
  plug_cameras_again
  expect_return 1
}

# The depth camera alone goes away while it streams, and comes back as soon as it is let go: no frames without depth until then.
case_v4l2_depth_unplugged() {
  start_streaming
  pass_log
  v4l2-ctl -d "$depth_node" -c disconnect=1
  expect_log "source: $depth_node"
  expect_return 1
}

# Unplugged and plugged in again three times in a row.
case_v4l2_unplugged_often() {
  start_streaming
  for _ in 1 2 3; do
    pass_log
    unplug_cameras
    expect_loss
    plug_cameras_again
    expect_log 'source: frames come'
  done
  expect_return 3
}

# A camera that is not there at the start is waited for.
case_v4l2_plugged_late() {
  write_v4l2_config auto </dev/null
  start_posed
  expect_log 'source: .*/dev/video.: open'
  plug_cameras
  expect_log 'source: frames come'
  expect_poses 3
  end_posed
}

# The driver reports a fatal error (poll fails, then EIO): the camera is opened again.
case_v4l2_fatal_error() {
  start_streaming
  pass_log
  v4l2-ctl -d "$color_node" -c inject_fatal_streaming_error=1
  expect_log "source: $color_node"
  expect_return 1
}

# The driver refuses to set up buffers, to queue one, to start streaming: told by name each time, and tried until it works.
case_v4l2_start_errors() {
  plug_cameras
  write_v4l2_config yuyv </dev/null
  local error
  for error in reqbufs qbuf streamon; do
    v4l2-ctl -d "$color_node" -c "inject_vidioc_${error}_error=1"
    start_posed
    expect_log "source: $color_node: ${error^^}"
    expect_poses 3
    end_posed
  done
}

# A buffer that the driver marks as bad is left out, and told.
case_v4l2_bad_buffer() {
  start_streaming
  v4l2-ctl -d "$color_node" -c inject_v4l2_buf_flag_error=1
  expect_log "source: $color_node"
  expect_poses 3
  end_posed
}

# A camera that falls silent is opened again, until it delivers.
case_v4l2_silent() {
  start_streaming
  pass_log
  v4l2-ctl -d "$color_node" -c percentage_of_dropped_buffers=100
  expect_log 'no frame for'
  v4l2-ctl -d "$color_node" -c percentage_of_dropped_buffers=0
  expect_return 1
  expect_log 'silent [1-9][0-9]* times'
}

# A driver that loses half of its buffers: the others make poses, and the lost ones are counted.
case_v4l2_lossy() {
  start_streaming
  v4l2-ctl -d "$color_node" -c percentage_of_dropped_buffers=50
  expect_poses 10
  end_posed
  expect_log 'not processed [1-9]'
}

# Sequence numbers of the device that wrap around: no gap of four billion frames is counted.
case_v4l2_sequence_wraps() {
  plug_cameras
  v4l2-ctl -d "$color_node" -c wrap_sequence_number=1
  write_v4l2_config yuyv </dev/null
  start_posed
  expect_poses 10
  sleep 15 # past the wrap, which comes after 128 images
  end_posed
  local missed
  missed=$(sed -n 's/.*not processed \([0-9]*\);.*/\1/p' posed.log | tail -n 1)
  [ "$missed" -lt 1000 ] || fail "$missed frames were not processed"
}

# A colour camera whose stamps are centuries ahead, and after 16 s wrap around to centuries ago: they are known not to be of the clock that
# the driver claims, and are mapped onto it; poses come before and after.
case_v4l2_stamps_leap() {
  plug_cameras
  v4l2-ctl -d "$color_node" -c wrap_timestamp=1
  write_v4l2_config yuyv <<<"$squares"
  start_posed
  expect_poses 5
  sleep 20
  expect_poses 5
  end_posed
}

# A camera that another program streams from is told to be busy, and taken when it is free.
case_v4l2_busy() {
  plug_cameras
  set_format "$color_node" YUYV 640 480
  v4l2-ctl -d "$color_node" --stream-mmap=4 --stream-to=/dev/null >/dev/null 2>&1 &
  local other=$!
  sleep 2
  write_v4l2_config yuyv </dev/null
  start_posed
  expect_log "source: $color_node.*(busy|another program)"
  kill "$other"
  expect_poses 3
  end_posed
}

# Controls of the configuration are set, also after the camera was away.
case_v4l2_controls() {
  plug_cameras
  echo 'controls = ["brightness=77", "horizontal_flip=1"]' | write_v4l2_config yuyv
  start_posed
  expect_poses 1
  [ "$(v4l2-ctl -d "$color_node" -C brightness)" = "brightness: 77" ] || fail "the brightness is not set"
  pass_log
  unplug_cameras
  expect_loss
  plug_cameras_again
  expect_log 'source: frames come'
  [ "$(v4l2-ctl -d "$color_node" -C brightness)" = "brightness: 77" ] || fail "the brightness is not set again"
  [ "$(v4l2-ctl -d "$color_node" -C horizontal_flip)" = "horizontal_flip: 1" ] || fail "the flip is not set again"
  end_posed
}

# A control that the camera does not have is named in the log.
case_v4l2_unknown_control() {
  plug_cameras
  echo 'controls = ["brightnes=77"]' | write_v4l2_config yuyv
  start_posed
  expect_log 'source: .*brightnes'
  end_posed
}

# A format and a size that the camera does not have are refused by name.
case_v4l2_refusals() {
  plug_cameras
  write_v4l2_config mjpeg </dev/null
  start_posed
  expect_log 'source: .*mjpeg'
  end_posed
  write_v4l2_config yuyv </dev/null
  sed -i 's/^width.*/width = 320/; s/^height.*/height = 240/; s/^cx.*/cx = 159.5/; s/^cy.*/cy = 119.5/' camera.toml
  start_posed
  expect_log 'source: .*320x240'
  end_posed
}

# As a service's user of its own in the group `video`, posed opens the cameras.
case_v4l2_as_service() {
  plug_cameras
  write_v4l2_config yuyv </dev/null
  chmod 755 /run/case
  systemd-run --quiet --unit=posed-case --service-type=notify --property=DynamicUser=yes --property=SupplementaryGroups=video \
    --property=DevicePolicy=closed --property='DeviceAllow=char-video4linux rw' \
    /usr/bin/posed --config /run/case/case.toml
  expect_poses 5
}

# record FOLDER FRAMES: with case.toml.
record() { timeout "$patience_s" posectl record --min-free 50MB --config case.toml "$1" --frames "$2"; }

# first_image FOLDER KIND: of a recording, `rgb` or `depth`, as a portable image on standard output.
first_image() { pngtopnm "$1/$(sed -n '/^#/d; s/^[^ ]* //p' "$1/$2.txt" | head -n 1)"; }

# What is recorded is what the camera sent: RGB exactly, as v4l2-ctl sees it, and 16 bits of depth exactly.
case_v4l2_recorded_exactly() {
  plug_cameras
  local bars='controls = ["test_pattern=1", "osd_text_mode=2"]'
  write_v4l2_config rgb24 <<<"$bars"
  record bars 2
  v4l2-ctl -d "$color_node" --stream-mmap=4 --stream-count=1 --stream-to=raw
  first_image bars rgb | tail -c $((640 * 480 * 3)) >recorded
  cmp recorded raw || fail "the recorded colours are not the camera's"
  v4l2-ctl -d "$depth_node" --stream-mmap=4 --stream-count=1 --stream-to=raw
  # A portable image has the high byte first, the camera's the low one.
  first_image bars depth | tail -c $((640 * 480 * 2)) | dd conv=swab status=none >recorded
  tail -c $((640 * 200 * 2)) raw >raw_end # below the texts in the image
  tail -c $((640 * 200 * 2)) recorded >recorded_end
  cmp recorded_end raw_end || fail "the recorded depth is not the camera's"
}

# Colour bars in YUV formats are recorded in the colours of the same bars in RGB, but for what half of the columns' colours lose.
case_v4l2_colors() {
  plug_cameras
  local bars='controls = ["test_pattern=1", "osd_text_mode=2"]' format decibel
  for format in rgb24 bgr24 yuyv nv12; do
    write_v4l2_config $format <<<"$bars"
    record $format 2
    first_image $format rgb >$format.ppm
  done
  cmp rgb24.ppm bgr24.ppm || fail "BGR is not recorded as RGB is"
  for format in yuyv nv12; do
    for decibel in $(pnmpsnr -machine rgb24.ppm $format.ppm | tee /dev/stderr | tr -c '0-9.\n' ' '); do
      awk "BEGIN { exit !($decibel > 30) }" || fail "$format differs from rgb24: PSNR $decibel dB"
    done
  done
}

# plug_loopback FOURCC: /dev/video10 delivers 640x480 images of this format, some ten a second, from standard input (see --stream-from-hdr).
plug_loopback() {
  modprobe v4l2loopback video_nr=10 card_label=loopback exclusive_caps=1
  udevadm settle
  v4l2-ctl -d /dev/video10 --set-fmt-video-out="width=640,height=480,pixelformat=$1" --stream-out-mmap=4 --stream-from-hdr=- <&0 >producer.log 2>&1 &
}

# as_frame FILE: with the header that v4l2-ctl reads: four letters, and the length, its high byte first.
as_frame() {
  local length
  length=$(printf '%08x' "$(stat --format=%s "$1")")
  printf '%b' "rdhV\\x${length:0:2}\\x${length:2:2}\\x${length:4:2}\\x${length:6:2}"
  cat "$1"
}

# frames FILE...: for ever, one after the other.
frames() {
  local file
  while :; do
    for file in "$@"; do
      as_frame "$file"
      sleep 0.1
    done
  done
}

# JPEG images, whose length is another each time, are decoded: as `mjpeg` and as what `auto` finds.
case_v4l2_jpeg() {
  plug_cameras
  set_format "$color_node" RGB3 640 480
  v4l2-ctl -d "$color_node" -c test_pattern=4 --stream-mmap=4 --stream-count=1 --stream-to=raw
  local quality format
  for quality in 50 70 90; do
    { printf 'P6\n640 480\n255\n'; cat raw; } | cjpeg -quality $quality -outfile $quality.jpg
  done
  plug_loopback MJPG < <(frames 50.jpg 70.jpg 90.jpg)
  for format in mjpeg auto; do
    write_v4l2_config $format /dev/video10 </dev/null
    start_posed
    expect_poses 5
    expect_log 'state: tracking'
    end_posed
  done
}

# JPEG images that end too early or are none are left out and told; the others make poses.
case_v4l2_jpeg_damaged() {
  plug_cameras
  set_format "$color_node" RGB3 640 480
  v4l2-ctl -d "$color_node" -c test_pattern=4 --stream-mmap=4 --stream-count=1 --stream-to=raw
  { printf 'P6\n640 480\n255\n'; cat raw; } | cjpeg -quality 70 -outfile whole.jpg
  head -c 5000 whole.jpg >torn.jpg
  head -c 5000 /dev/urandom >noise.jpg
  plug_loopback MJPG < <(frames whole.jpg torn.jpg whole.jpg noise.jpg)
  write_v4l2_config mjpeg /dev/video10 </dev/null
  start_posed
  expect_log 'source: /dev/video10: '
  expect_poses 5
  end_posed
}

# A depth camera that delivers colours is refused, with the format that it offers.
case_v4l2_depth_of_wrong_format() {
  plug_cameras
  head -c $((640 * 480 * 4)) /dev/zero >zero
  plug_loopback BGR4 < <(frames zero)
  write_v4l2_config yuyv <<<"$squares"
  sed -i "s#$depth_node#/dev/video10#; s#^format = \"y16\"#format = \"z16\"#" case.toml
  start_posed
  expect_log 'source: /dev/video10: .*z16.*BGR4'
  end_posed
}
