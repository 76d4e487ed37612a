#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "config/config.h"
#include "core/clock.h"
#include "core/estimates.h"
#include "core/result.h"
#include "core/se3.h"
#include "daemon/health.h"
#include "drivers/rgbd_source.h"

namespace posed {

struct AppOptions {
  bool publish = true;  ///< start LCM; false for tools that only want the trajectory
  /// Called for every frame the tracker processed, in order, after it was published, on the publisher thread. May block for short
  /// (in lockstep nothing is lost; in real time the queue before the publisher overflows and counts).
  std::function<void(const PoseEstimate&)> on_estimate;
  /// Called when the source skips a bad frame or fails, on the capture thread, with the reason.
  std::function<void(const Error&)> on_source_error;
};

/// The pipeline: the one place that owns the threads and wires source, tracker, mapper and publisher together (docs/threads.md).
/// The daemon and `posectl replay` run this same class. With Pacing::Realtime every stage has its own thread. With Pacing::Lockstep
/// capture, tracking and mapping take turns on one thread, so that nothing is dropped and the result is a function of the input
/// alone. Thread-bound to the thread that made it, but for `health`, which is thread-safe.
class App {
 public:
  /// Opens the source and allocates everything. Nothing runs yet.
  static Result<std::unique_ptr<App>> create(const Config& config, AppOptions options, const Clock& clock);
  virtual ~App() = default;

  virtual const SourceInfo& source_info() const = 0;

  /// Starts the threads.
  virtual Status start() = 0;

  /// Waits until the source has ended (or failed) and everything behind it is drained and published, at most `timeout_ns`.
  virtual bool wait_finished(TimeNs timeout_ns) = 0;

  /// Stops and joins all threads; what is in the queues is dropped. Idempotent, and what the destructor does.
  virtual void stop() = 0;

  virtual HealthReport health() const = 0;

  /// After `stop`: the present pose of a keyframe, to rebuild the final trajectory as T_map_keyframe * T_reference_camera.
  virtual std::optional<Se3> keyframe_pose(std::uint64_t keyframe) const = 0;
};

}  // namespace posed
