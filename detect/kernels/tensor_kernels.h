#pragma once

#include <cstddef>
#include <cstdint>

#include "core/simd_level.h"

/// The loops of the network runner that are not oneDNN's. Tensors are interleaved (NHWC: all channels of a pixel side by side)
/// unless called planar. Sizes are in elements; no pointer needs an alignment. All are reentrant; none allocates.
namespace posed {

/// 8-bit values q stand for scale (q - zero_point).
struct Quantization {
  float scale = 1;
  std::int32_t zero_point = 0;
};

/// One of the tensors that a concatenation joins.
struct ConcatPart {
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;  ///< of a pixel
};

struct TensorKernels {
  /// A planar image to interleaved pixels, all of it (step 1) or as SpaceToDepth (step 2: 4 channels times as many).
  void (*interleave)(const float* planes, int channels, int height, int width, int step, float* out);
  void (*interleave_u8)(const float* planes, int channels, int height, int width, int step, Quantization to, std::uint8_t* out);

  void (*deinterleave)(const float* in, std::size_t channels, std::size_t pixels, float* planes);

  void (*concat)(const ConcatPart* parts, std::size_t count, std::size_t pixels, std::uint8_t* out);

  void (*upsample2x)(const std::uint8_t* in, std::size_t height, std::size_t width, std::size_t pixel_bytes, std::uint8_t* out);

  void (*add)(const float* a, const float* b, std::size_t count, float* out);
  void (*add_u8)(const std::uint8_t* a, Quantization of_a, const std::uint8_t* b, Quantization of_b, std::size_t count,
                 Quantization to, std::uint8_t* out);

  void (*quantize)(const float* in, std::size_t count, Quantization to, std::uint8_t* out);
  void (*dequantize)(const std::uint8_t* in, std::size_t count, Quantization of, float* out);

  /// Sum and maximum of each channel over all pixels.
  void (*channel_statistics)(const float* in, std::size_t pixels, std::size_t channels, float* sums, float* maxima);

  /// out = in * gates[channel], and each pixel's mean and maximum over the channels of it.
  void (*gate_channels)(const float* in, const float* gates, std::size_t pixels, std::size_t channels, float* out, float* means,
                        float* maxima);

  /// One row of the correlation of two planes, whose rows lie `stride` apart, with kernels of kernel x kernel weights each. The
  /// planes are padded: row y, column x of the result needs rows y to y + kernel - 1 and columns x to x + kernel - 1.
  void (*correlate_row)(const float* means, const float* maxima, std::size_t stride, const float* weights, std::size_t kernel,
                        float bias, std::size_t width, float* out);

  /// In place, to 1e-6.
  void (*sigmoid)(float* values, std::size_t count);

  /// values *= gates[pixel].
  void (*gate_pixels)(float* values, const float* gates, std::size_t pixels, std::size_t channels);
};

/// The kernels for `level`, one of supported_simd_levels().
const TensorKernels& tensor_kernels(SimdLevel level);

/// Those for best_simd_level().
const TensorKernels& tensor_kernels();

}  // namespace posed
