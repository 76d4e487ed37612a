#pragma once

#include <vector>

#include "detect/inference_engine.h"

namespace posed::test {

/// All values of all outputs, one after the other.
inline std::vector<float> all_outputs(const InferenceEngine& engine) {
  std::vector<float> values;
  for (const InferenceOutput& output : engine.outputs()) {
    values.insert(values.end(), output.values.begin(), output.values.end());
  }
  return values;
}

}  // namespace posed::test
