#include "config/source_schema.h"

#include <limits>

namespace posed {

namespace {

bool is_control(std::string_view text) {
  const std::size_t equals = text.find('=');
  return is_path(text) && equals != std::string_view::npos && equals > 0 && equals + 1 < text.size();
}

constexpr TextRule kDevicePath = {"the path of a device, or \"\"", is_path};
constexpr TextRule kControl = {"a text NAME=VALUE", is_control};
constexpr std::size_t kMaxControls = 64;
constexpr std::size_t kMaxFaults = 256;

void add_recorded(SchemaBuilder& schema, SourceConfig& c) {
  schema.section("source.replay", "A recording in the TUM RGB-D layout, for `kind = \"replay\"`.")
      .key("sequence", TextField{&c.replay.sequence, {"the path of a folder", is_path}}, "",
           "Folder of the recording, with rgb.txt and depth.txt. A relative path starts at this file's folder. Must be set for "
           "`kind = \"replay\"`.")
      .key("associations", TextField{&c.replay.associations, {"the path of a file, or \"\"", is_path}}, "",
           "File of lines `colour-stamp colour-path depth-stamp depth-path`. A relative path starts at this file's folder. Empty: "
           "colour and depth are paired by their stamps.")
      .key("max_stamp_difference_s", real(c.replay.max_stamp_difference_s, 0.0, 1.0), "s",
           "Colour and depth images whose stamps differ by more are not paired.")
      .key("decode_ahead", integer(c.replay.decode_ahead, 1, 64), "frames",
           "Images decoded before they are due, on a thread of their own.")
      .key("loop", BoolField{&c.replay.loop}, "", "Begin again at the end of the recording.");
  schema.section("source.synthetic", "The rendered world, for `kind = \"synthetic\"`. Its image size is the calibration's.")
      .key("world",
           choice(c.synthetic.world, {{"room", SyntheticWorldKind::Room},
                                      {"corridor", SyntheticWorldKind::Corridor},
                                      {"office", SyntheticWorldKind::Office},
                                      {"twin_rooms", SyntheticWorldKind::TwinRooms}}),
           "",
           "Where the camera is: `room` sweeps the view once around a furnished room in 60 s; the others are walked through, round "
           "after round: `corridor` is a ring, 30 m and 45 s a round; `office` has 10 x 8 m, desks and partitions, 43 s a round; "
           "`twin_rooms` are two rooms that look exactly alike, joined by a corridor, 40 s a round.")
      .key("mode", choice(c.synthetic.mode, {{"sitting", SyntheticMode::Sitting}, {"walking", SyntheticMode::Walking}}), "",
           "What the people in the room do: `sitting` moves heads and arms, `walking` crosses the view.")
      .key("people", integer(c.synthetic.people, 0, 20), "", "People in the room; the other worlds have none, and need 0.")
      .key("seed", integer(c.synthetic.seed, 0, std::numeric_limits<std::int64_t>::max()), "",
           "Of the random world, motion and noise: the same seed renders the same frames.")
      .key("rate_hz", real(c.synthetic.rate_hz, 1.0, 240.0), "Hz", "Frame rate.")
      .key("duration_s", real(c.synthetic.duration_s, 0.0, 1e6), "s", "Length of the simulation; 0 is endless.")
      .key("sensor_noise", BoolField{&c.synthetic.sensor_noise}, "",
           "Add the noise, quantisation and holes of a real depth camera.");
}

void add_node(SchemaBuilder& schema, V4l2Config& c) {
  schema.key("buffers", integer(c.buffers, 2, 32), "frames", "Buffers that the driver fills; it may ask for more.")
      .key("controls", TextListField{&c.controls, kControl, kMaxControls}, "",
           "Settings of the camera, set in this order at each opening, as `exposure_time_absolute=100`: names as `v4l2-ctl -L` "
           "shows them.");
}

void add_cameras(SchemaBuilder& schema, SourceConfig& c) {
  schema.section("source.live", "What holds for every camera.")
      .key("rate_hz", real(c.live.rate_hz, 1.0, 240.0), "Hz", "Frame rate asked for; the nearest that the camera has is taken.")
      .key("stall_timeout_s", real(c.live.stall_timeout_s, 0.1, 60.0), "s",
           "A camera that delivers nothing for so long is closed and opened again.")
      .key("retry_period_s", real(c.live.retry_period_s, 0.05, 60.0), "s",
           "Longest wait between two attempts to open a camera that is away; the first ones follow sooner.")
      .key("max_stamp_difference_s", real(c.live.max_stamp_difference_s, 0.0, 1.0), "s",
           "Colour and depth images whose stamps differ by more are not paired.");
  schema.section("source.openni2", "A camera by OpenNI2, for `kind = \"openni2\"`. Its images have the calibration's size.")
      .key("device", TextField{&c.openni2.device, {"a URI, `serial:NUMBER`, the path of an .oni recording, or \"\"", is_path}}, "",
           "Which camera. Empty: the first one found.")
      .key("registration", BoolField{&c.openni2.registration}, "",
           "Let the device register depth to colour. Needed, but for recordings that are registered.")
      .key("frame_sync", BoolField{&c.openni2.frame_sync}, "", "Let the device take colour and depth at one time, where it can.")
      .key("auto_exposure", BoolField{&c.openni2.auto_exposure}, "", "Of the colour camera, where it can be set.")
      .key("auto_white_balance", BoolField{&c.openni2.auto_white_balance}, "", "Of the colour camera, where it can be set.");
  schema.section("source.v4l2", "A colour camera by V4L2, for `kind = \"v4l2\"`. Its images have the calibration's size.")
      .key("device", TextField{&c.v4l2.device, kDevicePath}, "", "Such as /dev/video0. Must be set for `kind = \"v4l2\"`.")
      .key("format", choice(c.v4l2.format, {"auto", "yuyv", "nv12", "mjpeg", "rgb24", "bgr24", "grey"}), "",
           "Format of the pixels; `auto` takes the first of these that the camera has.");
  add_node(schema, c.v4l2);
  schema
      .section("source.libcamera",
               "A colour camera by libcamera, for `kind = \"libcamera\"`. Its images have the calibration's size.")
      .key("camera", TextField{&c.libcamera.camera, {"the id of a camera, or \"\"", is_path}}, "",
           "As `posectl devices` shows it. Empty: the first one found.")
      .key("buffers", integer(c.libcamera.buffers, 2, 32), "frames", "Requests in flight.")
      .key("controls", TextListField{&c.libcamera.controls, kControl, kMaxControls}, "",
           "Settings of the camera, as `ExposureTime=10000`: libcamera's names.");
  schema.section("source.depth", "A depth camera with a V4L2 node of its own, beside a colour camera by V4L2 or libcamera.")
      .key("device", TextField{&c.depth.node.device, kDevicePath}, "", "Such as /dev/video2.")
      .key("format", choice(c.depth.node.format, {"auto", "z16", "y16"}), "", "Format of the pixels, 16 bits of depth either way.");
  add_node(schema, c.depth.node);
  schema
      .key("calibration", TextField{&c.depth.calibration, {"the name of a file, or \"\"", is_path}}, "",
           "Calibration of the depth camera, found as `camera.calibration` is. Empty: the device registers depth to colour, and "
           "`camera.calibration` has the units of depth.")
      .key("T_camera_depth", PoseField{&c.depth.T_camera_depth}, "m",
           "Pose of the depth camera in the colour camera's frame: it maps depth camera coordinates to colour camera coordinates.");
}

}  // namespace

void add_source(SchemaBuilder& schema, SourceConfig& c) {
  schema.section("source", "Where frames come from and how fast.")
      .key("kind",
           choice(c.kind, {{"synthetic", SourceKind::Synthetic},
                           {"replay", SourceKind::Replay},
                           {"openni2", SourceKind::OpenNi2},
                           {"v4l2", SourceKind::V4l2},
                           {"libcamera", SourceKind::Libcamera}}),
           "",
           "`synthetic` renders a world, such as a room with walking people; `replay` reads a recording; `openni2`, `v4l2` and "
           "`libcamera` are cameras. RGB-D is needed: `v4l2` and `libcamera` take depth from the node of `source.depth`.")
      .key("pacing", choice(c.pacing, {{"realtime", Pacing::Realtime}, {"lockstep", Pacing::Lockstep}}), "",
           "`realtime` delivers frames when their stamps say and drops what cannot be kept up with; `lockstep` processes every "
           "frame, as fast as possible, and repeats exactly: for recordings and the rendered world.");
  schema.key("faults", TextListField{&c.faults, {"KIND FIRST-LAST [AMOUNT]", is_path}, kMaxFaults}, "",
             "Faults of a camera to put into a recording or the rendered world, for tests, as `black 120-150`: drop, thin N, "
             "duplicate, freeze, black, white, zero_depth, nan_depth, half, stamp SECONDS; frames by number.");
  add_recorded(schema, c);
  add_cameras(schema, c);
}

void add_gpio(SchemaBuilder& schema, GpioConfig& c) {
  constexpr int kMaxLine = 4095;
  constexpr int kMaxPattern_ms = 60'000;
  constexpr std::size_t kMaxSteps = 16;
  const auto pattern = [](std::vector<int>& value) { return IntegerListField{&value, 10, kMaxPattern_ms, kMaxSteps}; };
  schema.section("gpio", "Lines of a GPIO chip: a status light, an input that pauses, a trigger for the camera.")
      .key("chip", TextField{&c.chip, {"a name, label or path, or \"\"", is_path}}, "",
           "Such as gpiochip0. Empty: no lines are used.")
      .key("status_line", integer(c.status_line, -1, kMaxLine), "", "Output that shows the state, by its offset; -1: none.")
      .key("enable_line", integer(c.enable_line, -1, kMaxLine), "",
           "Input that pauses the daemon while it is inactive, by its offset; -1: none.")
      .key("trigger_line", integer(c.trigger_line, -1, kMaxLine), "",
           "Output with a pulse for each frame that the camera is to take, by its offset; -1: none.")
      .key("status_active_low", BoolField{&c.status_active_low}, "", "The light shines while the line is low.")
      .key("enable_active_low", BoolField{&c.enable_active_low}, "", "The daemon runs while the line is low.")
      .key("trigger_active_low", BoolField{&c.trigger_active_low}, "", "A pulse is low.")
      .key("trigger_rate_hz", real(c.trigger_rate_hz, 1.0, 240.0), "Hz", "Pulses a second.")
      .key("waiting_ms", pattern(c.waiting_ms), "ms",
           "How the light shows that the camera is away: times on, off, on and so forth, repeated. One number: always on. Empty: "
           "off.")
      .key("initializing_ms", pattern(c.initializing_ms), "ms", "The same while there is no map yet.")
      .key("tracking_ms", pattern(c.tracking_ms), "ms", "The same while the pose is known.")
      .key("lost_ms", pattern(c.lost_ms), "ms", "The same while the camera is lost.")
      .key("paused_ms", pattern(c.paused_ms), "ms", "The same while `enable_line` pauses the daemon.");
}

}  // namespace posed
