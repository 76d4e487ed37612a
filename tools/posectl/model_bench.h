#pragma once

#include <cstddef>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "detect/inference_engine.h"

namespace posed {

/// What to time.
struct ModelBenchRequest {
  std::vector<std::string> networks;  ///< config/model_name.h
  bool float32 = true;
  bool int8 = true;             ///< of files that are calibrated
  bool against_opencv = false;  ///< of ONNX files named without a size
  std::size_t runs = 200;
  bool steps = false;  ///< also each step of the runners
};

/// The durations of one engine's runs.
struct ModelTiming {
  std::string label;
  std::vector<TimeNs> durations_ns;
};

/// p in [0, 1] of the durations, the nearest of those that occurred.
TimeNs quantile_ns(std::vector<TimeNs> durations_ns, double p);

/// Runs all engines on one thread in turn, `runs` times round, so that what disturbs the machine disturbs all alike, and prints a
/// table of median, 99 % quantile and the ratio of medians to the first engine's. Thread-bound. Errors: those of the files and
/// engines; InvalidArgument where nothing is left to time.
Status bench_models(const ModelBenchRequest& request, std::ostream& out);

}  // namespace posed
