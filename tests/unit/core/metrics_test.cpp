#include "core/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr double kRelativeError = 1.0 / 32;  // as metrics.h promises
constexpr TimeNs kRange = TimeNs{1} << 42;

double exact_quantile_ms(const std::vector<TimeNs>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return to_ms(sorted[std::max<std::size_t>(rank, 1) - 1]);
}

void expect_quantiles_as_promised(std::vector<TimeNs> values) {
  LatencyHistogram histogram;
  double sum_ms = 0;
  for (const TimeNs value : values) {
    histogram.record(value);
    sum_ms += to_ms(value);
  }
  std::sort(values.begin(), values.end());
  const LatencySummary summary = histogram.summary();
  EXPECT_EQ(summary.count, values.size());
  EXPECT_DOUBLE_EQ(summary.max_ms, to_ms(values.back()));
  EXPECT_NEAR(summary.mean_ms, sum_ms / static_cast<double>(values.size()), 1e-9 * sum_ms);
  const auto check = [&](double q, double measured_ms) {
    const double exact_ms = exact_quantile_ms(values, q);
    EXPECT_GE(measured_ms, exact_ms * (1 - 1e-12)) << "q " << q;  // two roundings of one value, no more
    EXPECT_LE(measured_ms, exact_ms * (1 + kRelativeError)) << "q " << q;
  };
  check(0.50, summary.p50_ms);
  check(0.95, summary.p95_ms);
  check(0.99, summary.p99_ms);
  check(0.999, summary.p999_ms);
}

TEST(Counter, Counts) {
  Counter counter;
  EXPECT_EQ(counter.value(), 0u);
  counter.add();
  counter.add(4);
  EXPECT_EQ(counter.value(), 5u);
}

TEST(LatencyHistogram, OfNothingIsAllZero) {
  const LatencySummary summary = LatencyHistogram().summary();
  EXPECT_EQ(summary.count, 0u);
  EXPECT_EQ(summary.mean_ms, 0);
  EXPECT_EQ(summary.p50_ms, 0);
  EXPECT_EQ(summary.p999_ms, 0);
  EXPECT_EQ(summary.max_ms, 0);
}

TEST(LatencyHistogram, OfOneValueIsThatValueExactly) {
  for (const TimeNs value : {TimeNs{0}, TimeNs{1}, TimeNs{31}, TimeNs{32}, TimeNs{1'234'567}, kRange - 1, kRange, 5 * kRange}) {
    LatencyHistogram histogram;
    histogram.record(value);
    const LatencySummary summary = histogram.summary();
    EXPECT_EQ(summary.count, 1u);
    EXPECT_DOUBLE_EQ(summary.p50_ms, to_ms(value));
    EXPECT_DOUBLE_EQ(summary.p999_ms, to_ms(value));
    EXPECT_DOUBLE_EQ(summary.max_ms, to_ms(value));
  }
}

TEST(LatencyHistogram, QuantilesAreValuesThatWereRecordedNotInterpolated) {
  LatencyHistogram histogram;
  for (TimeNs value = 1; value <= 20; ++value) {  // each in a bucket of its own, so exact
    histogram.record(value);
  }
  const LatencySummary summary = histogram.summary();
  EXPECT_DOUBLE_EQ(summary.p50_ms, to_ms(10));
  EXPECT_DOUBLE_EQ(summary.p95_ms, to_ms(19));
  EXPECT_DOUBLE_EQ(summary.p99_ms, to_ms(20));
}

TEST(LatencyHistogram, KeepsItsPromiseAtEveryEdgeOfEveryBucket) {
  // The buckets of an octave [2^k, 2^(k+1)) begin at multiples of 2^(k-5); one below and the edge itself fall in different buckets.
  for (int k = 0; k < 42; ++k) {
    const TimeNs octave = TimeNs{1} << k;
    const TimeNs step = std::max<TimeNs>(octave / 32, 1);
    for (TimeNs edge = octave; edge < 2 * octave; edge += step) {
      LatencyHistogram histogram;
      histogram.record(edge - 1);
      histogram.record(edge);
      histogram.record(2 * kRange);  // so that the maximum does not cut the quantile down to the exact value
      const double p50_ms = histogram.summary().p50_ms;
      ASSERT_GE(p50_ms, to_ms(edge) * (1 - 1e-12)) << "edge " << edge;
      ASSERT_LE(p50_ms, to_ms(edge) * (1 + kRelativeError)) << "edge " << edge;
      histogram.record(edge - 1);
      histogram.record(0);
      histogram.record(0);
      ASSERT_LT(histogram.summary().p50_ms, to_ms(edge) * (1 - 1e-13)) << "edge " << edge;  // rank 3 of 6 is edge - 1
    }
  }
}

TEST(LatencyHistogram, KeepsItsPromiseForRandomSets) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 200; ++round) {
    const std::size_t size = 1 + random() % 3000;
    const auto spread = static_cast<int>(random() % 42);
    std::vector<TimeNs> values(size);
    for (TimeNs& value : values) {
      value = static_cast<TimeNs>(random() >> (63 - random() % static_cast<unsigned>(spread + 1)));
      value = std::min(value, kRange - 1);
    }
    expect_quantiles_as_promised(std::move(values));
  }
}

TEST(LatencyHistogram, KeepsItsPromiseForSizesWhereARankIsAWholeNumber) {
  for (const std::size_t size : {20u, 100u, 200u, 1000u, 2000u, 10'000u}) {
    std::vector<TimeNs> values(size);
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = static_cast<TimeNs>(1000 * (i + 1));
    }
    expect_quantiles_as_promised(std::move(values));
  }
}

TEST(LatencyHistogram, BeyondItsRangeAQuantileIsTheMaximum) {
  LatencyHistogram histogram;
  histogram.record(kRange);
  histogram.record(3 * kRange);
  const LatencySummary summary = histogram.summary();
  EXPECT_DOUBLE_EQ(summary.p50_ms, to_ms(3 * kRange));
  EXPECT_DOUBLE_EQ(summary.max_ms, to_ms(3 * kRange));
}

TEST(LatencyHistogram, TakesNegativeDurationsForZero) {
  LatencyHistogram histogram;
  histogram.record(-5);
  const LatencySummary summary = histogram.summary();
  EXPECT_EQ(summary.count, 1u);
  EXPECT_EQ(summary.mean_ms, 0);
  EXPECT_EQ(summary.max_ms, 0);
}

TEST(LatencyHistogram, ForgetsOnReset) {
  LatencyHistogram histogram;
  histogram.record(1000);
  histogram.reset();
  EXPECT_EQ(histogram.summary().count, 0u);
  histogram.record(10);
  EXPECT_DOUBLE_EQ(histogram.summary().max_ms, to_ms(10));
  EXPECT_DOUBLE_EQ(histogram.summary().mean_ms, to_ms(10));
}

TEST(LatencyHistogram, CountsEveryValueOfSeveralThreadsAndNeverReportsTooLow) {
  LatencyHistogram histogram;
  constexpr int kEach = 5'000;
  const auto record = [&] {
    for (int i = 0; i < kEach; ++i) {
      histogram.record(1000 + i);
    }
  };
  std::thread a(record);
  std::thread b(record);
  for (int i = 0; i < 200; ++i) {
    const LatencySummary summary = histogram.summary();  // while they record
    if (summary.count != 0) {
      EXPECT_GE(summary.p50_ms, to_ms(1000));
      EXPECT_GE(summary.max_ms, summary.p999_ms);
    }
  }
  a.join();
  b.join();
  EXPECT_EQ(histogram.summary().count, 2u * kEach);
  EXPECT_DOUBLE_EQ(histogram.summary().max_ms, to_ms(1000 + kEach - 1));
}

TEST(PeakRss, CoversMemoryThatWasTouched) {
  const std::uint64_t before = peak_rss_bytes();
  EXPECT_GT(before, 0u);
  constexpr std::size_t kBytes = 64u << 20;
  const std::vector<char> touched(kBytes, 1);
  EXPECT_EQ(touched[kBytes / 2], 1);
  EXPECT_GE(peak_rss_bytes(), kBytes);
  EXPECT_GE(peak_rss_bytes(), before);
}

}  // namespace
}  // namespace posed
