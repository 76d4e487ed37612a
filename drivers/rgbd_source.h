#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "config/config.h"
#include "core/clock.h"
#include "core/frame_pool.h"
#include "core/heartbeat.h"
#include "core/result.h"

namespace posed {

/// What a source can tell before it runs.
struct SourceInfo {
  std::string description;  ///< for people: "replay of DIR, 480 frames"
  int width = 0;
  int height = 0;
  double rate_hz = 0;              ///< nominal
  std::uint64_t total_frames = 0;  ///< 0 where unknown or endless
  std::size_t slots_held = 0;      ///< frames of the pool that the source may hold for itself (decoded ahead)
};

enum class CaptureKind {
  Frame,         ///< `frame` holds it
  SkippedFrame,  ///< a frame was bad and is left out; `error` says why, and the next call goes on
  Interrupted,   ///< the camera is away or silent and will be tried again; `error` says why, and the next call waits for it
  NoFreeSlot,    ///< the pool had no room; the frame is lost
  EndOfStream,   ///< a recording or a bounded simulation has ended
  Stopped,       ///< the stop token was triggered
  Failed,        ///< the device is gone or the source cannot go on; `error` says why
};

struct Capture {
  CaptureKind kind = CaptureKind::Stopped;
  FrameRef frame;
  Error error;
};

/// How a source fares. Counters only grow. Plain data.
struct SourceHealth {
  bool connected = true;           ///< it delivers frames; a camera that is away does not
  std::uint64_t reconnects = 0;    ///< times that a camera delivered again after it had been away or silent
  std::uint64_t stalls = 0;        ///< times that it delivered nothing for too long
  std::uint64_t unpaired = 0;      ///< colour or depth images left out for want of the other
  std::uint64_t clock_resets = 0;  ///< times that the device's clock began anew
  TimeNs clock_error_ns = 0;       ///< of the device's stamps on the monotonic clock, estimated
};

/// Delivers RGB-D frames. Thread-bound: `start` and `next` are called by one thread, the capture thread; the constructor may run
/// elsewhere, and `health` anywhere. No exception leaves it.
class RgbdSource {
 public:
  virtual ~RgbdSource() = default;

  virtual const SourceInfo& info() const = 0;

  /// Begins delivery into slots of `pool`, whose frames have this source's size. The pool must outlive the source.
  virtual Status start(FramePool& pool) = 0;

  /// Waits for the next frame. With Pacing::Realtime it returns when the frame is due; with Pacing::Lockstep as soon as it is
  /// ready, and then NoFreeSlot is never returned: it waits for a slot. Returns within 100 ms of a stop request.
  virtual Capture next(std::stop_token stop) = 0;

  /// Thread-safe.
  virtual SourceHealth health() const { return {}; }

  /// Beats at least ten times a second while `next` waits for a frame, so that who waits can be told from who hangs.
  const Heartbeat& heartbeat() const { return heartbeat_; }

 protected:
  Heartbeat heartbeat_;
};

/// Opens the source that the configuration names. Errors: NotFound, BadData, InvalidArgument (size differs from the calibration).
Result<std::unique_ptr<RgbdSource>> make_rgbd_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock);

}  // namespace posed
