#pragma once

#include <csignal>

namespace posed {

/// While it lives, SIGINT and SIGTERM set a flag instead of ending the process, so that a command can stop and write its outputs. A
/// second signal ends the process as usual. One at a time; thread-bound, but for `requested`, which is thread-safe.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool requested() const noexcept;

 private:
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
};

}  // namespace posed
