#pragma once

#include <atomic>
#include <cstdint>

#include "core/clock.h"

namespace posed {

/// Lets threads sleep until something happens elsewhere, without a mutex: the waker never blocks (a futex wake, and only where
/// somebody sleeps). Use: read `generation`, look for work, and where there is none `wait` for the generation to move on; a notify
/// in between is never lost. Thread-safe.
class WakeEvent {
 public:
  std::uint32_t generation() const noexcept { return generation_.load(std::memory_order_acquire); }

  /// Wakes all that wait. Does not block and does not allocate.
  void notify() noexcept;

  /// Sleeps until `generation() != seen` or the time-out has passed (at once where it is 0 or less; for ever with the largest
  /// value); true where it moved on.
  bool wait(std::uint32_t seen, TimeNs timeout_ns) noexcept;

 private:
  std::atomic<std::uint32_t> generation_{0};
  std::atomic<std::uint32_t> waiters_{0};
};

}  // namespace posed
