#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "detect/network.h"

namespace posed {

/// When to give up.
struct Deadline {
  const Clock* clock = &SystemClock::instance();
  TimeNs at_ns = std::numeric_limits<TimeNs>::max();  ///< never
};

/// How a run ended, and what it took by the deadline's clock.
struct RunOutcome {
  bool finished = false;      ///< false: abandoned, and the outputs mean nothing
  std::size_t steps_run = 0;  ///< before the end or the deadline
  TimeNs elapsed_ns = 0;
  TimeNs longest_step_ns = 0;  ///< of this run: the bound on how late an abandoned run notices its deadline
};

/// One output of a network: raw values, no sigmoid, no decoding. `values` stays where it is for the engine's life.
struct InferenceOutput {
  std::string name;
  std::vector<int> dimensions;    ///< slowest first, as in {1, channels, height, width}
  std::span<const float> values;  ///< of the last run that finished
};

/// Something that runs one network on one image at a time, on the thread that calls it. Thread-bound; instances are independent.
class InferenceEngine {
 public:
  InferenceEngine() = default;
  InferenceEngine(const InferenceEngine&) = delete;
  InferenceEngine& operator=(const InferenceEngine&) = delete;
  virtual ~InferenceEngine() = default;

  virtual std::string_view name() const = 0;

  virtual TensorShape input_shape() const = 0;

  /// To be filled before each run: channels, then rows, then columns; red, green and blue in [0, 1] for a network of photographs.
  /// Stays where it is for the engine's life; a run leaves it as it is.
  virtual std::span<float> input() = 0;

  /// Runs the network, or as much of it as it begins before the deadline. Error: Unavailable, where a library fails.
  virtual Result<RunOutcome> run(const Deadline& deadline) = 0;

  virtual std::span<const InferenceOutput> outputs() const = 0;
};

}  // namespace posed
