#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <string>

#include "core/clock.h"
#include "drivers/gpio/line_access.h"

namespace posed {

/// A line that is asked for again every second while it cannot be had, and is looked at every second while it is held, since a chip
/// that goes away tells nobody. Thread-bound, but for `is_held`.
class HeldLine {
 public:
  static constexpr TimeNs kRetry_ns = kNsPerSecond;
  static constexpr TimeNs kRecheck_ns = kNsPerSecond;

  using ErrorSink = std::function<void(const Error&)>;

  /// `access` must outlive it. `on_error` hears why the line is away, once for each new reason.
  HeldLine(LineAccess& access, LineRequest request, const ErrorSink& on_error)
      : access_(access), request_(std::move(request)), on_error_(on_error) {}

  /// The line, asked for where it is away and the time has come; null while it is away.
  GpioLine* get(TimeNs now_ns);

  /// When to call `get` again for a line that is away.
  TimeNs retry_ns() const { return retry_ns_; }

  /// The line has failed: gives it back.
  void lose(const Error& error, TimeNs now_ns);

  int event_fd() const { return line_ ? line_->event_fd() : -1; }

  bool is_held() const noexcept { return held_.load(std::memory_order_relaxed); }  ///< Thread-safe.

 private:
  void tell(const Error& error);

  LineAccess& access_;
  LineRequest request_;
  const ErrorSink& on_error_;
  std::unique_ptr<GpioLine> line_;
  TimeNs retry_ns_ = std::numeric_limits<TimeNs>::min();
  std::string told_;
  std::atomic<bool> held_{false};
};

}  // namespace posed
