// Compiled once for each instruction set, with POSED_KERNELS naming the table (see detect/CMakeLists.txt). No templates and no
// inline functions of the standard library: the linker would keep one copy of each for all instruction sets.
#include "detect/kernels/tensor_kernels.h"

namespace posed {
namespace {

constexpr std::size_t kLanes = 8;
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));

inline Floats load(const float* from) {
  Floats values;
  __builtin_memcpy(&values, from, sizeof values);
  return values;
}

inline void store(const Floats& values, float* to) {
  __builtin_memcpy(to, &values, sizeof values);
}

/// Rounds a value that is already in steps from the zero point's zero.
inline std::uint8_t to_u8(float value) {
  const float low = value < 0.0F ? 0.0F : value;
  const float clamped = low > 255.0F ? 255.0F : low;
  return static_cast<std::uint8_t>(static_cast<std::int32_t>(clamped + 0.5F));
}

/// Which element of the planes output channel `channel` of the first pixel is. SpaceToDepth takes the (row, column) offsets (0,0),
/// (1,0), (0,1), (1,1) one after the other.
inline std::size_t first_element(int channel, int channels, int height, int width) {
  const int offset = channel / channels;
  return static_cast<std::size_t>(((channel % channels) * height + offset % 2) * width + offset / 2);
}

void interleave(const float* __restrict planes, int channels, int height, int width, int step, float* __restrict out) {
  const int out_channels = channels * step * step;
  for (int y = 0; y < height / step; ++y) {
    float* const row = out + static_cast<std::size_t>(y * (width / step)) * static_cast<std::size_t>(out_channels);
    for (int c = 0; c < out_channels; ++c) {
      const float* const from = planes + first_element(c, channels, height, width) + static_cast<std::size_t>(y * step * width);
      for (int x = 0; x < width / step; ++x) {
        row[x * out_channels + c] = from[x * step];
      }
    }
  }
}

void interleave_u8(const float* __restrict planes, int channels, int height, int width, int step, Quantization to,
                   std::uint8_t* __restrict out) {
  const int out_channels = channels * step * step;
  const float factor = 1.0F / to.scale;
  const auto offset = static_cast<float>(to.zero_point);
  for (int y = 0; y < height / step; ++y) {
    std::uint8_t* const row = out + static_cast<std::size_t>(y * (width / step)) * static_cast<std::size_t>(out_channels);
    for (int c = 0; c < out_channels; ++c) {
      const float* const from = planes + first_element(c, channels, height, width) + static_cast<std::size_t>(y * step * width);
      for (int x = 0; x < width / step; ++x) {
        row[x * out_channels + c] = to_u8(from[x * step] * factor + offset);
      }
    }
  }
}

void deinterleave(const float* __restrict in, std::size_t channels, std::size_t pixels, float* __restrict planes) {
  for (std::size_t c = 0; c < channels; ++c) {
    for (std::size_t p = 0; p < pixels; ++p) {
      planes[c * pixels + p] = in[p * channels + c];
    }
  }
}

/// Copies `bytes` of each pixel; inlined where they are a constant, so that a pixel is a few instructions.
inline __attribute__((always_inline)) void copy_pixels(const std::uint8_t* from, std::size_t bytes, std::size_t pixels,
                                                       std::uint8_t* to, std::size_t to_stride) {
  for (std::size_t p = 0; p < pixels; ++p) {
    __builtin_memcpy(to + p * to_stride, from + p * bytes, bytes);
  }
}

void concat(const ConcatPart* parts, std::size_t count, std::size_t pixels, std::uint8_t* out) {
  std::size_t stride = 0;
  for (std::size_t i = 0; i < count; ++i) {
    stride += parts[i].bytes;
  }
  for (std::size_t i = 0; i < count; ++i) {
    switch (parts[i].bytes) {
      case 4: copy_pixels(parts[i].data, 4, pixels, out, stride); break;
      case 8: copy_pixels(parts[i].data, 8, pixels, out, stride); break;
      case 16: copy_pixels(parts[i].data, 16, pixels, out, stride); break;
      case 32: copy_pixels(parts[i].data, 32, pixels, out, stride); break;
      case 64: copy_pixels(parts[i].data, 64, pixels, out, stride); break;
      case 128: copy_pixels(parts[i].data, 128, pixels, out, stride); break;
      case 256: copy_pixels(parts[i].data, 256, pixels, out, stride); break;
      default: copy_pixels(parts[i].data, parts[i].bytes, pixels, out, stride); break;
    }
    out += parts[i].bytes;
  }
}

void upsample2x(const std::uint8_t* in, std::size_t height, std::size_t width, std::size_t pixel_bytes, std::uint8_t* out) {
  const std::size_t row_bytes = 2 * width * pixel_bytes;
  for (std::size_t y = 0; y < height; ++y) {
    std::uint8_t* const row = out + 2 * y * row_bytes;
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t* const pixel = in + (y * width + x) * pixel_bytes;
      __builtin_memcpy(row + 2 * x * pixel_bytes, pixel, pixel_bytes);
      __builtin_memcpy(row + (2 * x + 1) * pixel_bytes, pixel, pixel_bytes);
    }
    __builtin_memcpy(row + row_bytes, row, row_bytes);
  }
}

void add(const float* __restrict a, const float* __restrict b, std::size_t count, float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = a[i] + b[i];
  }
}

void add_u8(const std::uint8_t* __restrict a, Quantization of_a, const std::uint8_t* __restrict b, Quantization of_b,
            std::size_t count, Quantization to, std::uint8_t* __restrict out) {
  const float factor_a = of_a.scale / to.scale;
  const float factor_b = of_b.scale / to.scale;
  const float offset = static_cast<float>(to.zero_point) - factor_a * static_cast<float>(of_a.zero_point) -
                       factor_b * static_cast<float>(of_b.zero_point);
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = to_u8(factor_a * static_cast<float>(a[i]) + factor_b * static_cast<float>(b[i]) + offset);
  }
}

void quantize(const float* __restrict in, std::size_t count, Quantization to, std::uint8_t* __restrict out) {
  const float factor = 1.0F / to.scale;
  const auto offset = static_cast<float>(to.zero_point);
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = to_u8(in[i] * factor + offset);
  }
}

void dequantize(const std::uint8_t* __restrict in, std::size_t count, Quantization of, float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = of.scale * static_cast<float>(static_cast<std::int32_t>(in[i]) - of.zero_point);
  }
}

void channel_statistics(const float* __restrict in, std::size_t pixels, std::size_t channels, float* __restrict sums,
                        float* __restrict maxima) {
  for (std::size_t c = 0; c < channels; ++c) {
    sums[c] = 0;
    maxima[c] = in[c];
  }
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* const pixel = in + p * channels;
    for (std::size_t c = 0; c < channels; ++c) {
      sums[c] += pixel[c];
      maxima[c] = pixel[c] > maxima[c] ? pixel[c] : maxima[c];
    }
  }
}

void gate_channels(const float* __restrict in, const float* __restrict gates, std::size_t pixels, std::size_t channels,
                   float* __restrict out, float* __restrict means, float* __restrict maxima) {
  const std::size_t whole = channels / kLanes * kLanes;
  const float inverse = 1.0F / static_cast<float>(channels);
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* const x = in + p * channels;
    float* const y = out + p * channels;
    float sum = 0;
    float maximum = x[0] * gates[0];
    if (whole != 0) {
      Floats sums = load(x) * load(gates);
      Floats best = sums;
      store(sums, y);
      for (std::size_t c = kLanes; c < whole; c += kLanes) {
        const Floats values = load(x + c) * load(gates + c);
        store(values, y + c);
        sums += values;
        best = values > best ? values : best;
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        sum += sums[lane];
        maximum = best[lane] > maximum ? best[lane] : maximum;
      }
    }
    for (std::size_t c = whole; c < channels; ++c) {
      y[c] = x[c] * gates[c];
      sum += y[c];
      maximum = y[c] > maximum ? y[c] : maximum;
    }
    means[p] = sum * inverse;
    maxima[p] = maximum;
  }
}

void correlate_row(const float* __restrict means, const float* __restrict maxima, std::size_t stride,
                   const float* __restrict weights, std::size_t kernel, float bias, std::size_t width, float* __restrict out) {
  for (std::size_t x = 0; x < width; ++x) {
    out[x] = bias;
  }
  for (std::size_t plane = 0; plane < 2; ++plane) {
    for (std::size_t i = 0; i < kernel * kernel; ++i) {
      const float* const from = (plane == 0 ? means : maxima) + (i / kernel) * stride + i % kernel;
      const float weight = weights[plane * kernel * kernel + i];
      for (std::size_t x = 0; x < width; ++x) {
        out[x] += weight * from[x];
      }
    }
  }
}

void gate_pixels(float* __restrict values, const float* __restrict gates, std::size_t pixels, std::size_t channels) {
  for (std::size_t p = 0; p < pixels; ++p) {
    float* const pixel = values + p * channels;
    const float gate = gates[p];
    for (std::size_t c = 0; c < channels; ++c) {
      pixel[c] *= gate;
    }
  }
}

}  // namespace

extern const TensorKernels POSED_KERNELS;
const TensorKernels POSED_KERNELS = {interleave,    interleave_u8, deinterleave, concat,     upsample2x,
                                     add,           add_u8,        quantize,     dequantize, channel_statistics,
                                     gate_channels, correlate_row, gate_pixels};

}  // namespace posed
