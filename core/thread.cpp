#include "core/thread.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <pthread.h>
#include <sched.h>
#include <system_error>

#include <fmt/ranges.h>

#include "core/logging.h"

namespace posed {

namespace {

constexpr std::size_t kNameCapacity = 16;  // the kernel's, terminator included
thread_local char thread_name[kNameCapacity] = "";

void adopt_name(const std::string& name) {
  const std::size_t length = std::min(name.size(), kNameCapacity - 1);
  std::memcpy(thread_name, name.data(), length);
  thread_name[length] = '\0';
  pthread_setname_np(pthread_self(), thread_name);
}

std::string describe(int error) {
  return std::generic_category().message(error);
}

/// 0 or an errno.
int apply_policy(const ThreadOptions& options) {
  sched_param parameters{};
  if (options.policy == SchedulingPolicy::Fifo) {
    parameters.sched_priority = options.priority;
    return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  }
  // A thread inherits its creator's policy: a helper that a real-time thread starts must not run as urgently unasked.
  int inherited = SCHED_OTHER;
  if (const int error = pthread_getschedparam(pthread_self(), &inherited, &parameters); error != 0) {
    return error;
  }
  if (inherited != SCHED_FIFO && inherited != SCHED_RR) {
    return 0;
  }
  parameters.sched_priority = 0;
  return pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameters);
}

/// 0 or an errno.
int apply_affinity(const std::vector<int>& cpus) {
  if (cpus.empty()) {
    return 0;
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) {
    if (cpu < 0 || cpu >= CPU_SETSIZE) {
      return EINVAL;
    }
    CPU_SET(static_cast<std::size_t>(cpu), &set);
  }
  return pthread_setaffinity_np(pthread_self(), sizeof(set), &set);
}

}  // namespace

Status apply_thread_options(const ThreadOptions& options) {
  std::vector<std::string> refused;
  if (const int error = apply_policy(options); error != 0) {
    refused.push_back(options.policy == SchedulingPolicy::Fifo
                          ? fmt::format("SCHED_FIFO priority {} ({})", options.priority, describe(error))
                          : fmt::format("SCHED_OTHER ({})", describe(error)));
  }
  if (const int error = apply_affinity(options.cpus); error != 0) {
    refused.push_back(fmt::format("processors {} ({})", fmt::join(options.cpus, ","), describe(error)));
  }
  if (refused.empty()) {
    return {};
  }
  return make_error(ErrorCode::Unavailable,
                    fmt::format("thread {}: refused by the system: {}", options.name, fmt::join(refused, ", ")));
}

NamedThread::NamedThread(ThreadOptions options, Body body)
    : thread_([options = std::move(options), body = std::move(body)](std::stop_token stop) {
        adopt_name(options.name);
        if (const Status applied = apply_thread_options(options); !applied) {
          log_warning("{}; running on without", applied.error().message);
        }
        body(std::move(stop));
      }) {}

const char* current_thread_name() noexcept {
  return thread_name;
}

}  // namespace posed
