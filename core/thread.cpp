#include "core/thread.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <pthread.h>
#include <sched.h>
#include <system_error>
#include <unistd.h>

#include <fmt/ranges.h>
#include <sys/syscall.h>

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

/// As the kernel defines it (sched_setattr(2)); the C library of Debian 12 has neither the struct nor the call.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes);
  std::uint32_t policy = SCHED_OTHER;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
};

/// 0 or an errno.
int apply_deadline(const ThreadOptions& options) {
  constexpr std::uint32_t kDeadlinePolicy = 6;  // SCHED_DEADLINE
  constexpr std::uint64_t kResetOnFork = 1;     // SCHED_FLAG_RESET_ON_FORK: a thread of this kind may start no other without it
  SchedulingAttributes attributes;
  attributes.policy = kDeadlinePolicy;
  attributes.flags = kResetOnFork;
  attributes.runtime_ns = static_cast<std::uint64_t>(options.runtime_ns);
  attributes.deadline_ns = static_cast<std::uint64_t>(options.period_ns);
  attributes.period_ns = static_cast<std::uint64_t>(options.period_ns);
  return syscall(SYS_sched_setattr, 0, &attributes, 0U) == 0 ? 0 : errno;
}

/// 0 or an errno.
int apply_policy(const ThreadOptions& options) {
  if (options.policy == SchedulingPolicy::Deadline) {
    return apply_deadline(options);
  }
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

std::string policy_text(const ThreadOptions& options) {
  switch (options.policy) {
    case SchedulingPolicy::Fifo: return fmt::format("SCHED_FIFO priority {}", options.priority);
    case SchedulingPolicy::Deadline:
      return fmt::format("SCHED_DEADLINE {:.1f} of {:.1f} ms", to_ms(options.runtime_ns), to_ms(options.period_ns));
    case SchedulingPolicy::Normal: break;
  }
  return "SCHED_OTHER";
}

}  // namespace

Status apply_thread_options(const ThreadOptions& options) {
  std::vector<std::string> refused;
  if (const int error = apply_policy(options); error != 0) {
    refused.push_back(fmt::format("{} ({})", policy_text(options), describe(error)));
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
