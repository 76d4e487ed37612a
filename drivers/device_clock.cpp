#include "drivers/device_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace posed {

namespace {

constexpr std::size_t kBinsForSkew = 8;  // a slope over less time is noise

constexpr TimeNs kFarthest_ns = std::numeric_limits<TimeNs>::max() / 4;  // sums of a few of them do not overflow

/// a - b as of counters that wrap around.
TimeNs difference(TimeNs a, TimeNs b) {
  return static_cast<TimeNs>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

std::int64_t bin_of(TimeNs device_ns) {
  return device_ns / DeviceClock::kBin_ns;
}

}  // namespace

TimeNs DeviceClock::to_monotonic(TimeNs device_ns, TimeNs arrival_ns) {
  if (size_ > 0 && was_set(difference(device_ns, base_ns_), arrival_ns)) {
    restart();
    ++resets_;
  }
  if (size_ == 0) {
    base_ns_ = device_ns;
  }
  const TimeNs since_ns = difference(device_ns, base_ns_);
  const Sample sample{since_ns, arrival_ns - since_ns};
  last_device_ns_ = since_ns;
  add(sample);
  return since_ns + std::min(offset_at(since_ns), sample.offset_ns);
}

bool DeviceClock::was_set(TimeNs since_ns, TimeNs arrival_ns) const {
  if (since_ns < last_device_ns_ || since_ns > kFarthest_ns) {
    return true;
  }
  const TimeNs late_ns = arrival_ns - since_ns - offset_at(since_ns);
  return late_ns < -kEarliest_ns || late_ns > kLatest_ns;
}

void DeviceClock::restart() {
  first_ = 0;
  size_ = 0;
  skew_ = 0;
}

DeviceClock::Quality DeviceClock::quality() const {
  Quality quality{0, skew_ * 1e6, resets_};
  if (size_ == 0) {
    return quality;
  }
  std::array<TimeNs, kBins> distances{};
  for (std::size_t i = 0; i < size_; ++i) {
    const Sample& sample = bins_[(first_ + i) % kBins];
    distances[i] = std::abs(sample.offset_ns - offset_at(sample.device_ns));
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(size_ / 2);
  std::nth_element(distances.begin(), middle, distances.begin() + static_cast<std::ptrdiff_t>(size_));
  quality.error_ns = *middle;
  return quality;
}

TimeNs DeviceClock::offset_at(TimeNs since_ns) const {
  return offset_ns_ + static_cast<TimeNs>(std::llround(skew_ * static_cast<double>(since_ns - origin_ns_)));
}

void DeviceClock::add(const Sample& sample) {
  const std::int64_t bin = bin_of(sample.device_ns);
  if (size_ > 0 && bin == newest_bin_) {
    Sample& newest = bins_[(first_ + size_ - 1) % kBins];
    if (sample.offset_ns >= newest.offset_ns) {
      return;
    }
    newest = sample;
  } else {
    if (size_ == kBins) {
      first_ = (first_ + 1) % kBins;
      --size_;
    }
    bins_[(first_ + size_) % kBins] = sample;
    ++size_;
    newest_bin_ = bin;
  }
  fit();
}

void DeviceClock::fit() {
  // The lower convex hull of the periods, from left to right (Andrew's monotone chain); times relative to the first.
  struct Point {
    double x, y;
  };
  std::array<Point, kBins> hull{};
  std::size_t corners = 0;
  const Sample& oldest = bins_[first_];
  double mean_x = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    const Sample& sample = bins_[(first_ + i) % kBins];
    const Point p{static_cast<double>(sample.device_ns - oldest.device_ns),
                  static_cast<double>(sample.offset_ns - oldest.offset_ns)};
    mean_x += p.x / static_cast<double>(size_);
    while (corners >= 2) {
      const Point& a = hull[corners - 2];
      const Point& b = hull[corners - 1];
      if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0) {
        break;
      }
      --corners;
    }
    hull[corners++] = p;
  }
  origin_ns_ = oldest.device_ns;
  if (size_ >= kBinsForSkew) {
    std::size_t right = 1;
    while (right + 1 < corners && hull[right].x < mean_x) {
      ++right;
    }
    const Point& a = hull[right - 1];
    const Point& b = hull[right];
    const double slope = (b.y - a.y) / (b.x - a.x);
    if (std::abs(slope) <= kMaxSkew) {
      skew_ = slope;
      offset_ns_ = oldest.offset_ns + static_cast<TimeNs>(std::llround(a.y - slope * a.x));
      return;
    }
  }
  // Too little is known for a slope: the one known so far, below all.
  double lowest = 0;
  for (std::size_t i = 0; i < corners; ++i) {
    lowest = std::min(lowest, hull[i].y - skew_ * hull[i].x);
  }
  offset_ns_ = oldest.offset_ns + static_cast<TimeNs>(std::llround(lowest));
}

}  // namespace posed
