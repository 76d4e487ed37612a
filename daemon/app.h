#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "config/config.h"
#include "core/clock.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/result.h"
#include "core/se3.h"
#include "daemon/health.h"
#include "daemon/tracked_view.h"
#include "drivers/gpio_lines.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// Where the map comes from and goes to.
struct MapFiles {
  std::string load;             ///< empty: nothing is loaded
  bool may_be_missing = false;  ///< `load` need not exist: a new map then begins
  std::string save;             ///< empty: nothing is saved
};

/// What a configuration says of them: the daemon's files.
MapFiles map_files(const MapConfig& config);

struct AppOptions {
  bool publish = true;  ///< start LCM; false for tools that only want the trajectory
  /// Called for every frame the tracker processed, in order, after it was published, on the publisher thread. May block for short
  /// (in lockstep nothing is lost; in real time the queue before the publisher overflows and counts).
  std::function<void(const PoseEstimate&)> on_estimate;
  /// Called for every frame the detector has looked at, in order, likewise.
  std::function<void(const Detections&)> on_detections;
  /// Called for every frame the tracker processed, in order, on the tracking thread, whose time it takes: for lockstep.
  std::function<void(const TrackedView&)> on_tracked;
  /// Called when the source skips a bad frame or fails, on the capture thread, with the reason.
  std::function<void(const Error&)> on_source_error;
  const GpioLines* gpio = nullptr;    ///< whose health is told with the pipeline's own; must outlive the App
  std::optional<MapFiles> map_files;  ///< instead of those of the configuration
};

/// The pipeline: the one place that owns the threads and wires source, detector, tracker, mapper and publisher together
/// (docs/threads.md). The daemon and `posectl replay` run this same class. With Pacing::Realtime every stage has its own thread.
/// With Pacing::Lockstep capture, detection, tracking and mapping take turns on one thread, so that nothing is dropped and the
/// result is a function of the input alone. Thread-bound to the thread that made it, but for `health`, `set_paused` and
/// `request_map_save`, which are thread-safe.
class App {
 public:
  /// Opens the source, allocates everything and loads the map. Nothing runs yet. A map that cannot be used is an error
  /// (InvalidConfig), so that none is ever overwritten by a new one.
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

  /// Lets frames go instead of handing them on: no poses are made from the next frame on, until it is set back. The map, the
  /// source and the status go on. Does nothing in lockstep, whose result depends on its input alone. May come before `start`.
  virtual void set_paused(bool paused) = 0;

  /// Has the map saved soon, on the mapping thread; the log and `health` say what came of it. Error: InvalidConfig, where no file
  /// is configured.
  virtual Status request_map_save() = 0;

  /// After `stop`: the present pose of a keyframe, to rebuild the final trajectory as T_map_keyframe * T_reference_camera.
  virtual std::optional<Se3> keyframe_pose(std::uint64_t keyframe) const = 0;
};

}  // namespace posed
