#pragma once

#include <cstdint>
#include <string>

#include "core/clock.h"
#include "core/metrics.h"
#include "core/result.h"
#include "core/rgbd_frame.h"

namespace posed {

enum class CameraReadKind {
  Frame,     ///< colour and depth of one instant
  Nothing,   ///< none came within the time
  BadFrame,  ///< one came that cannot be used; `error` says why
  Gone,      ///< the device is away or failed, and must be opened again; `error` says why
  End,       ///< a recording has ended
};

struct CameraRead {
  CameraReadKind kind = CameraReadKind::Nothing;
  Error error;
};

/// What a camera counts, and how well its clock is known. Thread-safe: written by the capture thread, read by any.
struct CameraMetrics {
  Counter unpaired;      ///< colour or depth images left out for want of the other
  Counter clock_resets;  ///< times that the device's clock began anew
  Gauge clock_error_ns;  ///< DeviceClock::Quality::error_ns
};

/// An RGB-D camera that comes and goes: what a driver implements. CameraSource opens it, reads it, and opens it again.
/// Thread-bound to the capture thread, but for the constructor and `metrics`. No exception leaves it.
class Camera {
 public:
  virtual ~Camera() = default;

  virtual const std::string& description() const = 0;  ///< for people: "OpenNI2 camera, first one found"

  /// Finds the device and starts its streams. Leaves it closed where that fails: NotFound (it is away), Unavailable (another
  /// program has it), Unsupported (it cannot deliver what is asked), Io.
  virtual Status open() = 0;

  /// Waits at most `timeout_ns` for the next frame and writes its pixels, `capture_ns`, and as `sequence` the device's own count,
  /// whose gaps are frames lost (from any number on). `stamp_utc_ns` is left at 0 but for recordings that bring their own. A null
  /// `frame` takes the frame and lets it go. Does not allocate.
  virtual CameraRead read(RgbdFrame* frame, TimeNs timeout_ns) = 0;

  /// Ends streaming and gives everything of the device back. Nothing happens where it is closed.
  virtual void close() noexcept = 0;

  virtual const CameraMetrics& metrics() const = 0;
};

}  // namespace posed
