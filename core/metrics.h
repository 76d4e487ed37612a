#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/clock.h"

namespace posed {

/// An event count. Lock-free, thread-safe.
class Counter {
 public:
  void add(std::uint64_t n = 1) noexcept { value_.fetch_add(n, std::memory_order_relaxed); }
  std::uint64_t value() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

/// The newest of a value that goes up and down. Thread-safe, lock-free.
class Gauge {
 public:
  void set(std::int64_t value) noexcept { value_.store(value, std::memory_order_relaxed); }
  std::int64_t value() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::int64_t> value_{0};
};

/// Quantiles of a set of durations. Plain data.
struct LatencySummary {
  std::uint64_t count = 0;
  double mean_ms = 0;
  double p50_ms = 0;
  double p95_ms = 0;
  double p99_ms = 0;
  double p999_ms = 0;
  double max_ms = 0;
};

/// Durations in logarithmic buckets, each octave split in 32: a quantile (the smallest recorded value that is not below its share
/// of all) is at most 1/32 = 3.2 % too high and never too low, and the maximum is exact. Durations of 2^42 ns (73 minutes) and more
/// share one bucket; a quantile that falls there is the maximum. Negative durations count as 0. `record` is wait-free but for
/// the maximum (lock-free) and does not allocate. Thread-safe; a summary taken during recording or reset may miss the newest
/// values, and its mean may then be off by them.
class LatencyHistogram {
 public:
  void record(TimeNs duration_ns) noexcept;
  LatencySummary summary() const noexcept;
  void reset() noexcept;

 private:
  static constexpr int kSubBucketBits = 5;
  static constexpr int kRangeBits = 42;  // 2^42 ns = 73 min
  static constexpr std::size_t kBuckets = (static_cast<std::size_t>(kRangeBits - kSubBucketBits + 1) << kSubBucketBits) + 1;

  static std::size_t bucket_of(std::uint64_t ns) noexcept;
  static std::uint64_t upper_bound_ns(std::size_t bucket) noexcept;

  std::array<std::atomic<std::uint64_t>, kBuckets> counts_{};
  std::atomic<std::uint64_t> sum_ns_{0};
  std::atomic<std::uint64_t> max_ns_{0};
};

/// Largest resident set of this process so far [bytes] (getrusage).
std::uint64_t peak_rss_bytes();

}  // namespace posed
