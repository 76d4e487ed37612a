#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"

namespace posed {

enum class SchedulingPolicy {
  Normal,    ///< the system's time sharing, also where the starting thread is a real-time one
  Fifo,      ///< SCHED_FIFO
  Deadline,  ///< SCHED_DEADLINE: `runtime_ns` of processor time in every `period_ns`, before all other policies
};

/// How a thread is to run. What the system refuses degrades with one warning in the log, never with an error.
struct ThreadOptions {
  std::string name;  ///< shown by ps and top; the kernel keeps 15 characters
  SchedulingPolicy policy = SchedulingPolicy::Normal;
  int priority = 0;            ///< 1 to 99 for Fifo; ignored otherwise
  TimeNs runtime_ns = 0;       ///< for Deadline
  TimeNs period_ns = 0;        ///< for Deadline, and the deadline
  std::vector<int> cpus = {};  ///< empty: those of the thread that starts it
};

/// A thread with a name, a policy and a stop token that joins when it is destroyed (after asking it to stop). Thread-bound: the
/// object belongs to the thread that made it. The body must not throw. A system without room for one more thread is treated like
/// one without memory: std::system_error, which nobody is expected to catch.
class NamedThread {
 public:
  using Body = std::function<void(std::stop_token)>;

  NamedThread() = default;
  NamedThread(ThreadOptions options, Body body);

  void request_stop() noexcept { thread_.request_stop(); }
  void join() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  bool joinable() const noexcept { return thread_.joinable(); }

 private:
  std::jthread thread_;
};

/// Applies policy and affinity to the calling thread; the message of what was refused, where something was. Reentrant.
Status apply_thread_options(const ThreadOptions& options);

/// Name given to the calling thread by `NamedThread`, "" for others. Static storage: never allocates. Reentrant.
const char* current_thread_name() noexcept;

}  // namespace posed
