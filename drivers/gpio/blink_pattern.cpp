#include "drivers/gpio/blink_pattern.h"

#include <algorithm>

namespace posed {

BlinkPattern::BlinkPattern(const std::vector<int>& steps_ms) {
  TimeNs end_ns = 0;
  for (const int step_ms : steps_ms) {
    end_ns += step_ms * kNsPerMs;
    ends_ns_.push_back(end_ns);
  }
}

bool BlinkPattern::is_on(TimeNs elapsed_ns) const {
  if (ends_ns_.empty()) {
    return false;
  }
  const TimeNs in_round_ns = elapsed_ns % ends_ns_.back();
  const auto step = std::upper_bound(ends_ns_.begin(), ends_ns_.end(), in_round_ns) - ends_ns_.begin();
  return step % 2 == 0;
}

TimeNs BlinkPattern::next_change_ns(TimeNs elapsed_ns) const {
  if (ends_ns_.size() < 2) {
    return kNever_ns;
  }
  const TimeNs round_begin_ns = elapsed_ns - elapsed_ns % ends_ns_.back();
  const auto end = std::upper_bound(ends_ns_.begin(), ends_ns_.end(), elapsed_ns - round_begin_ns);
  // Where the last step is on, so is the first of the next round, and nothing changes between them.
  const bool goes_on = end + 1 == ends_ns_.end() && ends_ns_.size() % 2 == 1;
  return round_begin_ns + (goes_on ? ends_ns_.back() + ends_ns_.front() : *end);
}

}  // namespace posed
