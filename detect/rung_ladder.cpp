#include "detect/rung_ladder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace posed {

namespace {

constexpr double kQuantile = 0.95;
constexpr double kMarginUp = 0.9;  // of the budget that a larger rung must keep to
constexpr double kAbandoned = 1.5;

}  // namespace

RungLadder::RungLadder(std::vector<TimeNs> unloaded_ns, TimeNs budget_ns)
    : unloaded_ns_(std::move(unloaded_ns)), budget_ns_(budget_ns) {
  assert(!unloaded_ns_.empty() && unloaded_ns_.front() > 0 && std::is_sorted(unloaded_ns_.begin(), unloaded_ns_.end()));
  rung_ = unloaded_ns_.size() - 1;
  choose();
}

TimeNs RungLadder::expected_p95_ns(std::size_t rung) const {
  return static_cast<TimeNs>(factor_p95_ * static_cast<double>(unloaded_ns_[rung]));
}

void RungLadder::record_finished(std::size_t rung, TimeNs elapsed_ns) {
  record(static_cast<double>(elapsed_ns) / static_cast<double>(unloaded_ns_[rung]));
}

void RungLadder::record_abandoned(std::size_t rung, TimeNs elapsed_ns) {
  record(kAbandoned * std::max(static_cast<double>(elapsed_ns) / static_cast<double>(unloaded_ns_[rung]), 1.0));
}

void RungLadder::record(double factor) {
  factors_[count_++ % kWindow] = factor;
  const std::size_t held = std::min(count_, kWindow);
  std::array<double, kWindow> sorted = factors_;
  const auto rank = static_cast<std::size_t>(std::ceil(kQuantile * static_cast<double>(held))) - 1;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(rank),
                   sorted.begin() + static_cast<std::ptrdiff_t>(held));
  factor_p95_ = sorted[rank];
  choose();
}

void RungLadder::choose() {
  const auto fits = [&](std::size_t rung, double share) {
    return static_cast<double>(expected_p95_ns(rung)) <= share * static_cast<double>(budget_ns_);
  };
  while (rung_ > 0 && !fits(rung_, 1.0)) {
    --rung_;
  }
  while (rung_ + 1 < unloaded_ns_.size() && fits(rung_ + 1, kMarginUp)) {
    ++rung_;
  }
}

}  // namespace posed
