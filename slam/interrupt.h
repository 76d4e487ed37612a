#pragma once

#include <functional>

namespace posed {

/// Asks whether optional work is to be given up now: true ends it. Asked often and from inside loops, so it must be cheap, and it
/// must not throw. Empty: never.
using Interrupt = std::function<bool()>;

inline bool is_interrupted(const Interrupt& interrupt) {
  return interrupt && interrupt();
}

}  // namespace posed
