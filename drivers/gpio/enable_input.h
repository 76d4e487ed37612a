#pragma once

#include <atomic>
#include <optional>

#include "config/camera_source_config.h"
#include "drivers/gpio/held_line.h"

namespace posed {

/// Watches the enable line: a new level counts once the line has kept still for kSettle_ns. Before the line was read for the first
/// time the level is inactive, since nothing has said that the daemon may run; while the line is away the last level holds.
/// Thread-bound, but for `is_active` and `is_held`, which are thread-safe.
class EnableInput {
 public:
  static constexpr TimeNs kSettle_ns = 20 * kNsPerMs;
  static constexpr TimeNs kPoll_ns = 20 * kNsPerMs;  ///< between looks where the chip cannot tell of changes

  EnableInput(LineAccess& access, const GpioConfig& config, const HeldLine::ErrorSink& on_error);

  /// Looks at the line where it is due or where it has changed; when to call again.
  TimeNs step(TimeNs now_ns);

  /// Becomes readable when it is time for a step; -1: wait for the time alone.
  int event_fd() const { return settled_ns_ ? -1 : line_.event_fd(); }

  bool is_active() const noexcept { return active_.load(std::memory_order_relaxed); }
  bool is_held() const noexcept { return line_.is_held(); }

 private:
  /// When to look again.
  Result<TimeNs> look(GpioLine& line, TimeNs now_ns);

  HeldLine line_;
  bool known_ = false;                // whether the line was ever read
  std::optional<TimeNs> settled_ns_;  // the line moved; it has settled if it keeps still until then
  std::atomic<bool> active_{false};
};

}  // namespace posed
