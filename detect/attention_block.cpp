#include "detect/attention_block.h"

#include <algorithm>

#include "detect/kernels/tensor_kernels.h"

namespace posed {
namespace {

std::vector<float> transposed(const std::vector<float>& matrix, std::size_t rows) {
  const std::size_t columns = matrix.size() / rows;
  std::vector<float> result(matrix.size());
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      result[column * rows + row] = matrix[row * columns + column];
    }
  }
  return result;
}

/// out += matrix^T vector, for a matrix of [vector's size][size] values.
void add_product(const std::vector<float>& matrix, const float* vector, std::size_t size, float* out) {
  for (std::size_t row = 0; row < matrix.size() / size; ++row) {
    const float* const weights = matrix.data() + row * size;
    for (std::size_t i = 0; i < size; ++i) {
      out[i] += weights[i] * vector[row];
    }
  }
}

}  // namespace

AttentionBlock::AttentionBlock(const Cbam& cbam, const TensorShape& shape)
    : cbam_(cbam),
      channels_(static_cast<std::size_t>(shape.channels)),
      height_(static_cast<std::size_t>(shape.height)),
      width_(static_cast<std::size_t>(shape.width)),
      padding_(static_cast<std::size_t>(cbam.kernel / 2)),
      plane_stride_(width_ + 2 * padding_) {
  cbam_.weights1 = transposed(cbam.weights1, static_cast<std::size_t>(cbam.hidden));
  cbam_.weights2 = transposed(cbam.weights2, channels_);
}

std::size_t AttentionBlock::scratch_floats() const {
  return 2 * plane_stride_ * (height_ + 2 * padding_) + width_ + 3 * channels_ + 2 * static_cast<std::size_t>(cbam_.hidden);
}

void AttentionBlock::channel_gates(const float* means, const float* maxima, float* hidden, float* gates) const {
  const auto size = static_cast<std::size_t>(cbam_.hidden);
  float* const of_maxima = hidden + size;
  std::copy(cbam_.bias1.begin(), cbam_.bias1.end(), hidden);
  std::copy(cbam_.bias1.begin(), cbam_.bias1.end(), of_maxima);
  add_product(cbam_.weights1, means, size, hidden);
  add_product(cbam_.weights1, maxima, size, of_maxima);
  // The second layer is linear, so the two branches may be added before it.
  std::transform(hidden, hidden + size, of_maxima, hidden, [](float a, float b) { return std::max(a, 0.0F) + std::max(b, 0.0F); });
  std::transform(cbam_.bias2.begin(), cbam_.bias2.end(), gates, [](float bias) { return 2 * bias; });
  add_product(cbam_.weights2, hidden, channels_, gates);
  tensor_kernels().sigmoid(gates, channels_);
}

void AttentionBlock::run(const float* in, float* out, float* scratch) const {
  const TensorKernels& kernels = tensor_kernels();
  const std::size_t plane = plane_stride_ * (height_ + 2 * padding_);
  float* const means = scratch;
  float* const maxima = means + plane;
  float* const row = maxima + plane;
  float* const sums = row + width_;
  float* const channel_maxima = sums + channels_;
  float* const gates = channel_maxima + channels_;
  float* const hidden = gates + channels_;

  kernels.channel_statistics(in, height_ * width_, channels_, sums, channel_maxima);
  const float pixels = static_cast<float>(height_ * width_);
  std::transform(sums, sums + channels_, sums, [pixels](float sum) { return sum / pixels; });
  channel_gates(sums, channel_maxima, hidden, gates);

  std::fill(means, means + 2 * plane, 0.0F);
  const std::size_t row_floats = width_ * channels_;
  for (std::size_t y = 0; y < height_; ++y) {
    const std::size_t first = (y + padding_) * plane_stride_ + padding_;
    kernels.gate_channels(in + y * row_floats, gates, width_, channels_, out + y * row_floats, means + first, maxima + first);
  }
  for (std::size_t y = 0; y < height_; ++y) {
    const std::size_t first = y * plane_stride_;
    kernels.correlate_row(means + first, maxima + first, plane_stride_, cbam_.spatial_weights.data(),
                          static_cast<std::size_t>(cbam_.kernel), cbam_.spatial_bias, width_, row);
    kernels.sigmoid(row, width_);
    kernels.gate_pixels(out + y * row_floats, row, width_, channels_);
  }
}

}  // namespace posed
