#pragma once

#include <atomic>
#include <string>

#include "core/result.h"

namespace posed {

/// Holds OpenNI2 initialised: the one place in the process that does so. The last holder shuts it down. Initialising changes the
/// process's working directory for a moment (OpenNI2 does). A thread's first call of OpenNI2 (2.2.0.33) looks at every thread that
/// called it before, and crashes where one of them has ended: a thread that destroys what another used must have called it in time,
/// as `hold` does. Reentrant.
class OpenNi2Runtime {
 public:
  OpenNi2Runtime() = default;
  ~OpenNi2Runtime();
  OpenNi2Runtime(const OpenNi2Runtime&) = delete;
  OpenNi2Runtime& operator=(const OpenNi2Runtime&) = delete;

  /// Nothing happens where it holds already. Error: Unavailable.
  Status hold();

 private:
  bool holds_ = false;
};

/// What OpenNI2's drivers tell, on their own threads, of the device at one URI while the watch lives. Must not outlive the
/// OpenNi2Runtime. The getters are thread-safe and lock-free.
class OpenNi2Watch {
 public:
  explicit OpenNi2Watch(std::string uri);
  ~OpenNi2Watch();
  OpenNi2Watch(const OpenNi2Watch&) = delete;
  OpenNi2Watch& operator=(const OpenNi2Watch&) = delete;

  const std::string& uri() const { return uri_; }
  bool disconnected() const { return disconnected_.load(std::memory_order_acquire); }
  bool failed() const { return failed_.load(std::memory_order_acquire); }
  bool ended() const { return ended_.load(std::memory_order_acquire); }  ///< a recording: its last image has been delivered

 private:
  friend class OpenNi2Listener;

  const std::string uri_;
  std::atomic<bool> disconnected_{false};
  std::atomic<bool> failed_{false};
  std::atomic<bool> ended_{false};
};

/// What OpenNI2 has to say of its last failure in this thread, on one line.
std::string openni2_error();

}  // namespace posed
