#pragma once

#include <cstddef>
#include <vector>

#include "detect/network.h"

namespace posed {

/// `Cbam` on interleaved floats. Reentrant.
class AttentionBlock {
 public:
  AttentionBlock(const Cbam& cbam, const TensorShape& shape);

  std::size_t scratch_floats() const;

  /// `scratch` holds `scratch_floats()`; `in` and `out` must not overlap.
  void run(const float* in, float* out, float* scratch) const;

 private:
  /// Sigmoid of the perceptron's sum over both statistics.
  void channel_gates(const float* means, const float* maxima, float* hidden, float* gates) const;

  Cbam cbam_;  // weights1 transposed to [channels][hidden], weights2 to [hidden][channels]
  std::size_t channels_;
  std::size_t height_;
  std::size_t width_;
  std::size_t padding_;
  std::size_t plane_stride_;
};

}  // namespace posed
