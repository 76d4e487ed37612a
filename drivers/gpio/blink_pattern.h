#pragma once

#include <limits>
#include <vector>

#include "core/clock.h"

namespace posed {

/// A deadline that never comes.
constexpr TimeNs kNever_ns = std::numeric_limits<TimeNs>::max();

/// How a light blinks: a list of times on, off, on, ... that is repeated from its begin. A list of odd length ends as it begins,
/// with a time on, so one number is a light that shines, and none is a light that is off. Immutable.
class BlinkPattern {
 public:
  BlinkPattern() = default;
  explicit BlinkPattern(const std::vector<int>& steps_ms);

  /// At `elapsed_ns` >= 0 after the pattern's begin.
  bool is_on(TimeNs elapsed_ns) const;

  /// The first instant after `elapsed_ns` at which the light changes, likewise after the begin; kNever_ns where it never does.
  TimeNs next_change_ns(TimeNs elapsed_ns) const;

 private:
  std::vector<TimeNs> ends_ns_;  // of the steps, after the round's begin; the last one is the round's length
};

}  // namespace posed
