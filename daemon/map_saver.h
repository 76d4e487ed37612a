#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/clock.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "core/result.h"
#include "daemon/app.h"
#include "daemon/health.h"
#include "daemon/slam_ports.h"

namespace posed {

/// What came of the newest save.
struct MapSaveOutcome {
  std::uint64_t served = 0;  ///< requests up to this number are answered by it
  bool ok = false;
  std::string message;  ///< the file, or what went wrong
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  std::uint64_t bytes = 0;
  TimeNs duration_ns = 0;
};

/// Loads the mapper's map at the start and saves it when it is due: on request, every period while there is something new, and at
/// the end. Saving waits for the disk, which costs the mapping thread alone: the tracker goes on with the map it has. Thread-bound
/// to the mapping thread, but for what says otherwise.
class MapSaver {
 public:
  /// `period_ns` 0: no periodic saves. `mapper` and `clock` must outlive it.
  MapSaver(KeyframeMapper& mapper, MapFiles files, TimeNs period_ns, const Clock& clock);

  /// Before any thread runs: loads the map, and sees whether it will be possible to save it. True where there was a map. Errors:
  /// InvalidConfig, where the file cannot be used as it is or its folder cannot be written to; NotFound; Io.
  Result<bool> load();

  /// Of every keyframe that the mapper took in.
  void note_keyframe() { changed_ = extended_ = true; }

  void save_if_due();

  /// After the last keyframe: saves if there was any.
  void save_at_end();

  /// 0: no periodic saves. Thread-safe; holds from the last save on.
  void set_period(TimeNs period_ns) noexcept { period_ns_.store(period_ns, std::memory_order_relaxed); }

  /// Whether there is any file. Thread-safe.
  bool has_files() const { return !files_.load.empty() || !files_.save.empty(); }

  /// Whether there is a file to save to: InvalidConfig with the reason where not. Thread-safe.
  Status can_save() const;

  /// Asks for a save and gives the request's number. The mapping thread must then be woken. Thread-safe.
  std::uint64_t request() noexcept { return requested_.fetch_add(1, std::memory_order_acq_rel) + 1; }

  /// Thread-bound to whoever answers requests.
  const MapSaveOutcome& newest_outcome() noexcept;

  /// Thread-safe.
  void report(HealthReport& health) const;

 private:
  Status check_folder() const;
  void save(std::uint64_t requested);
  void note_success(MapSaveOutcome& outcome);

  KeyframeMapper& mapper_;
  MapFiles files_;
  std::atomic<TimeNs> period_ns_;
  const Clock& clock_;

  TimeNs last_save_ns_;    // or the start
  bool changed_ = false;   // since the last save
  bool extended_ = false;  // since the start
  std::uint64_t served_ = 0;
  std::atomic<std::uint64_t> requested_{0};
  LatestValue<MapSaveOutcome> outcomes_;
  Counter saves_;
  Counter errors_;
};

}  // namespace posed
