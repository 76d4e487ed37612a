#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "config/config.h"
#include "drivers/camera.h"
#include "drivers/device_clock.h"
#include "drivers/openni2/openni2_device.h"

namespace posed {

struct OpenNi2CameraOptions {
  OpenNi2Config device;
  LiveConfig live;
  Pacing pacing = Pacing::Realtime;
  int width = 640;
  int height = 480;
};

/// Colour and depth of an OpenNI2 device, paired by their stamps, or of a recording of one. A live frame's `capture_ns` is the
/// colour image's stamp on the monotonic clock. A recording's frames come when their stamps say, or, in lockstep, each as soon as
/// it is asked for, with `stamp_utc_ns` from the recording.
class OpenNi2Camera final : public Camera {
 public:
  OpenNi2Camera(const OpenNi2CameraOptions& options, const Clock& clock);
  ~OpenNi2Camera() override { close(); }

  const std::string& description() const override { return description_; }
  Status open() override;
  CameraRead read(RgbdFrame* frame, TimeNs timeout_ns) override;
  void close() noexcept override;
  const CameraMetrics& metrics() const override { return metrics_; }

 private:
  using Kind = OpenNi2Device::Kind;

  /// The newest image of a stream that has no partner yet.
  struct Waiting {
    openni::VideoFrameRef image;
    TimeNs arrival_ns = 0;
  };

  /// How far a recording has been played.
  struct Playback {
    bool played = false;  // a frame, at least
    bool over = false;
    TimeNs last_device_ns = 0;  // of the newest frame
    TimeNs due_ns = 0;          // of the frame that waits; then of the one before the next
    TimeNs last_capture_ns = std::numeric_limits<TimeNs>::min();
    TimeNs silent_ns = 0;  // waited in vain
  };

  CameraRead wait_for_image(TimeNs timeout_ns);
  CameraRead silence(bool ended, TimeNs waited_ns);
  CameraRead take(Kind kind);
  bool pair();
  void leave_out(Kind kind);
  CameraRead deliver(RgbdFrame* frame);
  void stamp_live(RgbdFrame& frame, TimeNs device_ns);
  void schedule(TimeNs device_ns);
  void stamp_recorded(RgbdFrame& frame, TimeNs device_ns);

  const OpenNi2CameraOptions options_;
  const bool recording_;
  const Clock& clock_;
  std::string description_;
  CameraMetrics metrics_;
  OpenNi2Device device_;
  std::array<Waiting, OpenNi2Device::kKinds> waiting_;
  bool paired_ = false;  // the images that wait make a frame
  bool open_ = false;
  bool delivered_ = false;  // a frame, since it was opened
  bool frame_sync_;
  DeviceClock device_clock_;
  std::uint64_t resets_told_ = 0;
  Playback playback_;
};

}  // namespace posed
