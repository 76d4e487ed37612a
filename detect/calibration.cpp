#include "detect/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "detect/network_passes.h"
#include "detect/network_runner.h"

namespace posed {
namespace {

constexpr std::size_t kBins = 2048;
constexpr double kSteps = 255.0;
/// How much of the range each end may lose, in bins: 48 candidates up to three quarters.
constexpr std::size_t kCandidates = 48;
constexpr std::size_t kCandidateBins = kBins / 64;

/// How often values fell into each part of their range.
struct Histogram {
  ValueRange range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  std::array<double, kBins> counts{};

  float bin_width() const { return (range.high - range.low) / static_cast<float>(kBins); }
  double centre(std::size_t bin) const {
    return static_cast<double>(range.low) + (static_cast<double>(bin) + 0.5) * static_cast<double>(bin_width());
  }
  void count(std::span<const float> values);
  double squared_error(const ValueRange& clipped) const;
};

void Histogram::count(std::span<const float> values) {
  const float bins_each = 1.0F / bin_width();
  for (const float value : values) {
    const float bin = (value - range.low) * bins_each;
    counts[bin > 0 ? static_cast<std::size_t>(std::min(bin, static_cast<float>(kBins - 1))) : 0] += 1;
  }
}

/// Of all values, were they clipped and rounded to 255 steps; a step's rounding error is evenly distributed.
double Histogram::squared_error(const ValueRange& clipped) const {
  const double step = (static_cast<double>(clipped.high) - static_cast<double>(clipped.low)) / kSteps;
  double error = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    if (counts[bin] != 0) {
      const double value = centre(bin);
      const double lost = value - std::clamp(value, static_cast<double>(clipped.low), static_cast<double>(clipped.high));
      error += counts[bin] * (lost == 0 ? step * step / 12 : lost * lost);
    }
  }
  return error;
}

/// The best of all pairs of candidates for the two ends, found one end after the other. Zero always stays inside, as quantisation
/// needs it.
ValueRange best_range(const Histogram& histogram) {
  ValueRange best = histogram.range;
  double least = histogram.squared_error(best);
  const float step = histogram.bin_width() * static_cast<float>(kCandidateBins);
  for (const bool upper : {true, false, true}) {
    for (std::size_t i = 0; i < kCandidates; ++i) {
      ValueRange candidate = best;
      if (upper) {
        candidate.high = std::max(histogram.range.high - step * static_cast<float>(i), 0.0F);
      } else {
        candidate.low = std::min(histogram.range.low + step * static_cast<float>(i), 0.0F);
      }
      if (!(candidate.low < candidate.high)) {
        break;
      }
      if (const double error = histogram.squared_error(candidate); error < least) {
        least = error;
        best = candidate;
      }
    }
  }
  return best;
}

/// Runs all images once, each tensor's values going to `observer`.
Status observe(NetworkRunner& runner, std::size_t count, const CalibrationImage& image,
               const NetworkRunner::TensorObserver& observer) {
  for (std::size_t i = 0; i < count; ++i) {
    if (const Status filled = image(i, runner.input()); !filled) {
      return filled;
    }
    if (const Status ran = runner.run_observed(observer); !ran) {
      return ran;
    }
  }
  return {};
}

/// With zero inside and a width, as a quantisation needs.
ValueRange usable(ValueRange range) {
  range.low = std::min(range.low, 0.0F);
  range.high = std::max(range.high, 0.0F);
  return range.low < range.high ? range : ValueRange{0.0F, 1.0F};
}

}  // namespace

Result<Network> calibrate(const Network& network, std::size_t count, const CalibrationImage& image, CalibrationMethod method) {
  if (count == 0) {
    return make_error(ErrorCode::InvalidArgument, "calibration needs at least one image");
  }
  Result<Network> simple = simplify(network);
  if (!simple) {
    return simple;
  }
  const Result<std::unique_ptr<NetworkRunner>> runner = NetworkRunner::create(*simple, Precision::Float32);
  if (!runner) {
    return tl::unexpected<Error>(runner.error());
  }
  std::vector<Histogram> histograms(simple->shapes().size());
  const auto of = [&](int tensor) -> Histogram& { return histograms[static_cast<std::size_t>(tensor)]; };
  Status done = observe(**runner, count, image, [&](int tensor, std::span<const float> values) {
    ValueRange& range = of(tensor).range;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    range = {std::min(range.low, *low), std::max(range.high, *high)};
  });
  for (Histogram& histogram : histograms) {
    histogram.range = usable(histogram.range);
  }
  if (done && method == CalibrationMethod::MeanSquaredError) {
    done = observe(**runner, count, image, [&](int tensor, std::span<const float> values) { of(tensor).count(values); });
  }
  if (!done) {
    return tl::unexpected<Error>(done.error());
  }
  std::vector<ValueRange> ranges;
  for (const Histogram& histogram : histograms) {
    ranges.push_back(method == CalibrationMethod::MeanSquaredError ? best_range(histogram) : histogram.range);
  }
  // A photograph's values are steps of 1/255 from 0 to 1: with this range, eight bits hold them exactly.
  if (ranges[0].low >= 0 && ranges[0].high <= 1) {
    ranges[0] = {0, 1};
  }
  if (const Status set = simple->set_ranges(std::move(ranges)); !set) {
    return tl::unexpected<Error>(set.error());
  }
  return simple;
}

}  // namespace posed
