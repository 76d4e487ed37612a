#pragma once

#include <cstdint>
#include <vector>

#include "detect/kernels/tensor_kernels.h"
#include "detect/network.h"

namespace posed {

/// The quantisation of each tensor of a calibrated, simplified network. Tensors of which one is only a copy of the other's values
/// (concatenated, enlarged, pooled) share one, so that copies stay copies. The inputs of those steps are computed in it directly.
/// Reentrant.
std::vector<Quantization> plan_quantization(const Network& network);

/// A convolution's weights in 8 bits, and the scale of each output channel.
struct QuantizedWeights {
  std::vector<std::int8_t> values;  ///< in the order of Convolution::weights
  std::vector<float> scales;        ///< [out_channels]
};

/// Symmetric, to [-limit, limit], each output channel by its largest weight. A channel of zeros has the scale 1.
QuantizedWeights quantize_weights(const Convolution& convolution, int limit = 127);

}  // namespace posed
