#include "core/thread.h"

#include <algorithm>
#include <cstring>
#include <system_error>

#include <pthread.h>
#include <sched.h>

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

std::string describe(int error) { return std::generic_category().message(error); }

}  // namespace

Status apply_thread_options(const ThreadOptions& options) {
  std::string refused;
  if (options.policy == SchedulingPolicy::Fifo) {
    sched_param parameters{};
    parameters.sched_priority = options.priority;
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters); error != 0) {
      refused = fmt::format("SCHED_FIFO priority {} ({})", options.priority, describe(error));
    }
  }
  if (!options.cpus.empty()) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (const int cpu : options.cpus) {
      if (cpu >= 0 && cpu < CPU_SETSIZE) {
        CPU_SET(static_cast<std::size_t>(cpu), &set);
      }
    }
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof(set), &set); error != 0) {
      refused += fmt::format("{}processors {} ({})", refused.empty() ? "" : ", ", fmt::join(options.cpus, ","), describe(error));
    }
  }
  if (refused.empty()) {
    return {};
  }
  return make_error(ErrorCode::Unavailable, fmt::format("thread {}: refused by the system: {}", options.name, refused));
}

NamedThread::NamedThread(ThreadOptions options, Body body)
    : thread_([options = std::move(options), body = std::move(body)](std::stop_token stop) {
        adopt_name(options.name);
        if (const Status applied = apply_thread_options(options); !applied) {
          log_warning("{}; running on without", applied.error().message);
        }
        body(std::move(stop));
      }) {}

const char* current_thread_name() noexcept { return thread_name; }

}  // namespace posed
