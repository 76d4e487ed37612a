#include <benchmark/benchmark.h>

#include "core/metrics.h"

namespace posed {
namespace {

void BM_LatencyHistogramRecord(benchmark::State& state) {
  LatencyHistogram histogram;
  TimeNs duration_ns = kNsPerMs;
  for (auto _ : state) {
    histogram.record(duration_ns);
    duration_ns = kNsPerMs + (duration_ns * 7) % (4 * kNsPerMs);  // over two octaves, as latencies of one stage are
  }
}
BENCHMARK(BM_LatencyHistogramRecord);

void BM_LatencyHistogramSummary(benchmark::State& state) {
  LatencyHistogram histogram;
  for (TimeNs i = 1; i <= 1000; ++i) {
    histogram.record(i * 10'000);
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(histogram.summary());
  }
}
BENCHMARK(BM_LatencyHistogramSummary);

}  // namespace
}  // namespace posed
