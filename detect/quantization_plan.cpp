#include "detect/quantization_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace posed {
namespace {

constexpr float kSteps = 255.0F;

/// Tensors that share a quantisation (disjoint sets).
class Groups {
 public:
  explicit Groups(std::size_t tensors) : parent_(tensors) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t of(std::size_t tensor) {
    while (parent_[tensor] != tensor) {
      tensor = parent_[tensor] = parent_[parent_[tensor]];
    }
    return tensor;
  }
  void join(std::size_t a, std::size_t b) { parent_[of(a)] = of(b); }

 private:
  std::vector<std::size_t> parent_;
};

bool copies_values(const Operation& operation) {
  return std::holds_alternative<Concat>(operation) || std::holds_alternative<Upsample2x>(operation) ||
         std::holds_alternative<MaxPool>(operation) || std::holds_alternative<SpaceToDepth>(operation);
}

/// The finest quantisation that reaches both ends, with a value for exact zero, which padding needs.
Quantization quantization_of(const ValueRange& range) {
  const float low = std::min(range.low, 0.0F);
  const float high = std::max(range.high, 0.0F);
  const float scale = (high - low) / kSteps;
  return {scale, static_cast<std::int32_t>(std::lround(-low / scale))};
}

}  // namespace

std::vector<Quantization> plan_quantization(const Network& network) {
  const std::size_t tensors = network.shapes().size();
  Groups groups(tensors);
  for (std::size_t i = 0; i < network.nodes().size(); ++i) {
    if (copies_values(network.nodes()[i].operation)) {
      for (const int input : network.nodes()[i].inputs) {
        groups.join(static_cast<std::size_t>(input), i + 1);
      }
    }
  }
  std::vector<ValueRange> shared = network.ranges();
  for (std::size_t tensor = 0; tensor < tensors; ++tensor) {
    ValueRange& range = shared[groups.of(tensor)];
    range.low = std::min(range.low, network.ranges()[tensor].low);
    range.high = std::max(range.high, network.ranges()[tensor].high);
  }
  std::vector<Quantization> quantizations(tensors);
  for (std::size_t tensor = 0; tensor < tensors; ++tensor) {
    quantizations[tensor] = quantization_of(shared[groups.of(tensor)]);
  }
  return quantizations;
}

QuantizedWeights quantize_weights(const Convolution& convolution, int limit) {
  const std::size_t each = convolution.weights.size() / static_cast<std::size_t>(convolution.out_channels);
  QuantizedWeights quantized;
  quantized.values.reserve(convolution.weights.size());
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(convolution.out_channels); ++channel) {
    const float* const weights = convolution.weights.data() + channel * each;
    const float largest = std::accumulate(weights, weights + each, 0.0F, [](float m, float w) { return std::max(m, std::abs(w)); });
    const float scale = largest > 0 ? largest / static_cast<float>(limit) : 1.0F;
    quantized.scales.push_back(scale);
    for (std::size_t i = 0; i < each; ++i) {
      quantized.values.push_back(static_cast<std::int8_t>(std::lround(weights[i] / scale)));
    }
  }
  return quantized;
}

}  // namespace posed
