#include "drivers/openni2/openni2_camera.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "drivers/openni2/openni2_devices.h"
#include "drivers/openni2/openni2_pixels.h"

namespace posed {

namespace {

constexpr TimeNs kLongestPause_ns = 2 * kNsPerSecond;  // of a recording; a longer one, or a step back, is a stamp gone wrong
// Where the stamps of a recording, which begin near 0, begin as UTC: 0 means that there is none.
constexpr std::int64_t kRecordingBegins_utc_ns = kNsPerSecond;

TimeNs device_ns(const openni::VideoFrameRef& image) {
  return static_cast<TimeNs>(image.getTimestamp()) * kNsPerUs;
}

std::string describe(const OpenNi2Config& config) {
  if (config.device.empty()) {
    return "OpenNI2 camera, first one found";
  }
  return fmt::format("OpenNI2 {} {}", is_openni2_recording(config.device) ? "recording" : "camera", config.device);
}

}  // namespace

OpenNi2Camera::OpenNi2Camera(const OpenNi2CameraOptions& options, const Clock& clock)
    : options_(options),
      recording_(is_openni2_recording(options.device.device)),
      clock_(clock),
      description_(describe(options.device)),
      device_(options.device, {options.width, options.height, options.live.rate_hz}),
      frame_sync_(options.device.frame_sync) {}

Status OpenNi2Camera::open() {
  if (Status opened = device_.open(frame_sync_); !opened) {
    return opened;
  }
  open_ = true;
  delivered_ = false;
  device_clock_.restart();
  playback_ = {};
  return {};
}

void OpenNi2Camera::close() noexcept {
  // OpenNI2 itself puts synchronous streams together by their frame indices, and where the driver counts its streams differently,
  // that delivers nothing, or images of different times. The way that did not deliver is changed.
  if (std::exchange(open_, false) && options_.device.frame_sync && !delivered_) {
    frame_sync_ = !frame_sync_;
  }
  for (Waiting& waiting : waiting_) {
    waiting.image.release();
  }
  paired_ = false;
  device_.close();
}

CameraRead OpenNi2Camera::read(RgbdFrame* frame, TimeNs timeout_ns) {
  if (playback_.over) {
    return {CameraReadKind::End, {}};
  }
  const TimeNs deadline_ns = clock_.now_ns() + timeout_ns;
  while (!paired_) {
    CameraRead got = wait_for_image(std::max<TimeNs>(0, deadline_ns - clock_.now_ns()));
    if (got.kind != CameraReadKind::Frame) {
      return got;
    }
    paired_ = pair();
    if (paired_ && recording_) {
      schedule(device_ns(waiting_[Kind::Color].image));
    }
  }
  if (recording_ && options_.pacing == Pacing::Realtime && clock_.now_ns() < playback_.due_ns) {
    clock_.sleep_until(std::min(playback_.due_ns, deadline_ns));
    if (clock_.now_ns() < playback_.due_ns) {
      return {};
    }
  }
  return deliver(frame);
}

/// Frame: an image came, and waits for its partner.
CameraRead OpenNi2Camera::wait_for_image(TimeNs timeout_ns) {
  const OpenNi2Watch& watch = device_.watch();
  if (watch.disconnected()) {
    return {CameraReadKind::Gone, {ErrorCode::NotFound, fmt::format("OpenNI2 camera '{}' was unplugged", watch.uri())}};
  }
  if (watch.failed()) {
    return {CameraReadKind::Gone, {ErrorCode::Unavailable, fmt::format("OpenNI2 camera '{}' reports that it failed", watch.uri())}};
  }
  // Asked before the wait: what came before the end is then seen by it.
  const bool ended = watch.ended();
  std::array<openni::VideoStream*, OpenNi2Device::kKinds> streams = {&device_[Kind::Color].stream, &device_[Kind::Depth].stream};
  int ready = 0;
  const auto timeout_ms = static_cast<int>((timeout_ns + kNsPerMs - 1) / kNsPerMs);
  switch (openni::OpenNI::waitForAnyStream(streams.data(), static_cast<int>(streams.size()), &ready, timeout_ms)) {
    case openni::STATUS_OK: return take(static_cast<Kind>(ready));
    case openni::STATUS_TIME_OUT: return silence(ended, timeout_ms * kNsPerMs);
    default: break;
  }
  return {CameraReadKind::Gone, {ErrorCode::Io, fmt::format("OpenNI2 camera '{}': {}", watch.uri(), openni2_error())}};
}

CameraRead OpenNi2Camera::silence(bool ended, TimeNs waited_ns) {
  if (!recording_) {
    return {};
  }
  playback_.silent_ns += waited_ns;
  const bool broken = !ended && playback_.silent_ns >= from_seconds(options_.live.stall_timeout_s);
  if (!ended && !broken) {
    return {};
  }
  for (const Kind kind : {Kind::Color, Kind::Depth}) {
    leave_out(kind);
  }
  device_.stop();  // its player would run on, idle
  playback_.over = true;
  if (broken) {
    return {CameraReadKind::BadFrame,
            {ErrorCode::BadData, fmt::format("recording '{}' breaks off: no image for {:.1f} s, and no end", device_.watch().uri(),
                                             to_seconds(playback_.silent_ns))}};
  }
  return {CameraReadKind::End, {}};
}

CameraRead OpenNi2Camera::take(Kind kind) {
  OpenNi2Device::Stream& stream = device_[kind];
  Waiting& waiting = waiting_[kind];
  leave_out(kind);
  if (stream.stream.readFrame(&waiting.image) != openni::STATUS_OK) {
    return {CameraReadKind::Gone, {ErrorCode::Io, fmt::format("OpenNI2 camera '{}': {}", device_.watch().uri(), openni2_error())}};
  }
  waiting.arrival_ns = clock_.now_ns();
  stream.gate.taken();
  playback_.silent_ns = 0;
  if (!is_of_mode(waiting.image, stream.mode)) {
    waiting.image.release();
    return {CameraReadKind::BadFrame,
            {ErrorCode::BadData, fmt::format("OpenNI2 device '{}' delivered an image that is not {}", device_.watch().uri(),
                                             openni2_mode_name(stream.mode))}};
  }
  return {CameraReadKind::Frame, {}};
}

void OpenNi2Camera::leave_out(Kind kind) {
  if (waiting_[kind].image.isValid()) {
    waiting_[kind].image.release();
    metrics_.unpaired.add();
  }
}

/// Whether both images wait and belong together; if they do not, the older one is left out.
bool OpenNi2Camera::pair() {
  const openni::VideoFrameRef& color = waiting_[Kind::Color].image;
  const openni::VideoFrameRef& depth = waiting_[Kind::Depth].image;
  if (!color.isValid() || !depth.isValid()) {
    return false;
  }
  const TimeNs difference_ns = device_ns(color) - device_ns(depth);
  if (std::abs(difference_ns) <= from_seconds(options_.live.max_stamp_difference_s)) {
    return true;
  }
  leave_out(difference_ns < 0 ? Kind::Color : Kind::Depth);
  return false;
}

CameraRead OpenNi2Camera::deliver(RgbdFrame* frame) {
  openni::VideoFrameRef& color = waiting_[Kind::Color].image;
  openni::VideoFrameRef& depth = waiting_[Kind::Depth].image;
  if (frame != nullptr) {
    write_color(color, device_[Kind::Color].mirrored, *frame);
    write_depth(depth, device_[Kind::Depth].mirrored, *frame);
    frame->sequence = static_cast<std::uint32_t>(color.getFrameIndex());
    frame->depth_offset_ns = device_ns(depth) - device_ns(color);
    if (recording_) {
      stamp_recorded(*frame, device_ns(color));
    } else {
      stamp_live(*frame, device_ns(color));
    }
  }
  color.release();
  depth.release();
  paired_ = false;
  delivered_ = true;
  return {CameraReadKind::Frame, {}};
}

void OpenNi2Camera::stamp_live(RgbdFrame& frame, TimeNs device_ns) {
  frame.capture_ns = device_clock_.to_monotonic(device_ns, waiting_[Kind::Color].arrival_ns);
  const DeviceClock::Quality quality = device_clock_.quality();
  metrics_.clock_error_ns.set(quality.error_ns);
  metrics_.clock_resets.add(quality.resets - std::exchange(resets_told_, quality.resets));
}

void OpenNi2Camera::schedule(TimeNs device_ns) {
  if (playback_.played) {
    const TimeNs period_ns = device_ns - playback_.last_device_ns;
    playback_.due_ns += period_ns > 0 ? std::min(period_ns, kLongestPause_ns) : from_seconds(1.0 / options_.live.rate_hz);
  } else {
    playback_.due_ns = clock_.now_ns();
    playback_.played = true;
  }
  playback_.last_device_ns = device_ns;
}

void OpenNi2Camera::stamp_recorded(RgbdFrame& frame, TimeNs device_ns) {
  if (options_.pacing == Pacing::Realtime) {
    frame.capture_ns = playback_.due_ns;
    return;
  }
  playback_.last_capture_ns = std::max(playback_.last_capture_ns + 1, clock_.now_ns());
  frame.capture_ns = playback_.last_capture_ns;
  frame.stamp_utc_ns = kRecordingBegins_utc_ns + device_ns;
}

}  // namespace posed
