#pragma once

#include <string>
#include <utility>

#include "config/config.h"
#include "core/thread.h"

namespace posed {

/// A thread's options as the configuration has them. Reentrant.
inline ThreadOptions thread_options(std::string name, const ThreadConfig& config) {
  const SchedulingPolicy policy = config.policy == ThreadPolicyName::Fifo ? SchedulingPolicy::Fifo : SchedulingPolicy::Normal;
  return {std::move(name), policy, config.priority, config.cpus};
}

}  // namespace posed
