#include "core/metrics.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <sys/resource.h>

namespace posed {

// Values below 2^kSubBucketBits have a bucket each; above, an octave [2^k, 2^(k+1)) is split in 2^kSubBucketBits equal buckets.
std::size_t LatencyHistogram::bucket_of(std::uint64_t ns) noexcept {
  constexpr std::uint64_t kLinear = 1ULL << kSubBucketBits;
  if (ns < kLinear) {
    return static_cast<std::size_t>(ns);
  }
  const int octave = static_cast<int>(std::bit_width(ns)) - 1 - kSubBucketBits;
  const auto sub_bucket = static_cast<std::size_t>(ns >> octave) - kLinear;
  return std::min((static_cast<std::size_t>(octave + 1) << kSubBucketBits) + sub_bucket, kBuckets - 1);
}

std::uint64_t LatencyHistogram::upper_bound_ns(std::size_t bucket) noexcept {
  constexpr std::uint64_t kLinear = 1ULL << kSubBucketBits;
  if (bucket < kLinear) {
    return bucket;
  }
  const auto octave = static_cast<int>(bucket >> kSubBucketBits) - 1;
  const std::uint64_t sub_bucket = bucket & (kLinear - 1);
  return ((kLinear + sub_bucket + 1) << octave) - 1;
}

void LatencyHistogram::record(TimeNs duration_ns) noexcept {
  const auto ns = static_cast<std::uint64_t>(std::max<TimeNs>(duration_ns, 0));
  sum_ns_.fetch_add(ns, std::memory_order_relaxed);
  std::uint64_t max = max_ns_.load(std::memory_order_relaxed);
  while (ns > max && !max_ns_.compare_exchange_weak(max, ns, std::memory_order_relaxed)) {
  }
  // Last and with release: a summary that counts this value also sees a maximum that covers it.
  counts_[bucket_of(ns)].fetch_add(1, std::memory_order_release);
}

LatencySummary LatencyHistogram::summary() const noexcept {
  std::array<std::uint64_t, kBuckets> counts{};
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    counts[i] = counts_[i].load(std::memory_order_acquire);
    total += counts[i];
  }
  LatencySummary summary;
  summary.count = total;
  if (total == 0) {
    return summary;
  }
  const std::uint64_t max_ns = max_ns_.load(std::memory_order_relaxed);
  const auto quantile_ms = [&](double q) {
    const auto rank = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(total))));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i + 1 < kBuckets; ++i) {
      seen += counts[i];
      if (seen >= rank) {
        return static_cast<double>(std::min(upper_bound_ns(i), max_ns)) * 1e-6;
      }
    }
    return static_cast<double>(max_ns) * 1e-6;  // in the last bucket, which has no upper bound
  };
  summary.mean_ms = static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) / static_cast<double>(total) * 1e-6;
  summary.p50_ms = quantile_ms(0.50);
  summary.p95_ms = quantile_ms(0.95);
  summary.p99_ms = quantile_ms(0.99);
  summary.p999_ms = quantile_ms(0.999);
  summary.max_ms = static_cast<double>(max_ns) * 1e-6;
  return summary;
}

void LatencyHistogram::reset() noexcept {
  for (std::atomic<std::uint64_t>& count : counts_) {
    count.store(0, std::memory_order_relaxed);
  }
  sum_ns_.store(0, std::memory_order_relaxed);
  max_ns_.store(0, std::memory_order_relaxed);
}

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace posed
