#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "daemon/health.h"

namespace posed {

/// Tells threads that work from threads that are stuck, each by a deadline of its own. Thread-bound.
class ProgressWatch {
 public:
  /// Opening a camera may take seconds; a frame or a pose never does. An adjustment of a large map, and saving it, takes longest.
  static constexpr TimeNs kCaptureDeadline_ns = 10 * kNsPerSecond;
  static constexpr TimeNs kTrackerDeadline_ns = 3 * kNsPerSecond;
  static constexpr TimeNs kMapperDeadline_ns = 60 * kNsPerSecond;
  static constexpr TimeNs kDetectorDeadline_ns = 10 * kNsPerSecond;
  static constexpr TimeNs kPublisherDeadline_ns = 10 * kNsPerSecond;

  struct Change {
    std::string_view thread;
    bool stuck = false;  ///< or it moves again
    TimeNs silent_ns = 0;
  };

  /// Which threads got stuck or free since the look before.
  std::vector<Change> look(const ThreadProgress& progress);

  /// Capture and tracking get on: without them there is no pose, so the watchdog may starve. The others' work can be done without.
  bool makes_progress() const { return !stuck_[kCapture] && !stuck_[kTracker]; }

  /// Names of the threads that are stuck, with commas; empty: none.
  std::string stuck() const;

 private:
  static constexpr std::size_t kCapture = 0;
  static constexpr std::size_t kTracker = 1;
  std::array<bool, 5> stuck_{};
};

}  // namespace posed
