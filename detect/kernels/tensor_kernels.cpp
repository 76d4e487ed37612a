// Compiled once for each instruction set, with POSED_KERNELS naming the table (see detect/CMakeLists.txt). No templates and no
// inline functions of the standard library: the linker would keep one copy of each for all instruction sets.
#include "detect/kernels/tensor_kernels.h"

namespace posed {
namespace {

#ifdef __AVX__
constexpr std::size_t kLanes = 8;  // 16 would leave most of a vector unused: the smaller networks have 8 to 32 channels
#else
constexpr std::size_t kLanes = 4;
#endif
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));

inline Floats load(const float* from) {
  Floats values;
  __builtin_memcpy(&values, from, sizeof values);
  return values;
}

inline void store(const Floats& values, float* to) {
  __builtin_memcpy(to, &values, sizeof values);
}

using Quad = float __attribute__((vector_size(4 * sizeof(float))));
constexpr std::size_t kQuads = kLanes / 4;

/// The vector's parts of four, added up; and the larger of each.
inline Quad folded_sum(const Floats& values) {
  Quad quads[kQuads];
  __builtin_memcpy(quads, &values, sizeof values);
  return kQuads == 1 ? quads[0] : quads[0] + quads[kQuads - 1];
}

inline Quad folded_maximum(const Floats& values) {
  Quad quads[kQuads];
  __builtin_memcpy(quads, &values, sizeof values);
  return quads[0] > quads[kQuads - 1] ? quads[0] : quads[kQuads - 1];
}

inline float larger(float a, float b) {
  return a > b ? a : b;
}

/// Rounds a value that is already in steps from the zero point's zero.
inline std::uint8_t to_u8(float value) {
  const float low = value < 0.0F ? 0.0F : value;
  const float clamped = low < 255.0F ? low : 255.0F;  // also what is no number, which no integer could hold
  return static_cast<std::uint8_t>(static_cast<std::int32_t>(clamped + 0.5F));
}

/// Which element of the planes output channel `channel` of the first pixel is. SpaceToDepth takes the (row, column) offsets (0,0),
/// (1,0), (0,1), (1,1) one after the other.
inline std::size_t first_element(int channel, int channels, int height, int width) {
  const int offset = channel / channels;
  return static_cast<std::size_t>(((channel % channels) * height + offset % 2) * width + offset / 2);
}

constexpr int kStemChannels = 12;  // of a colour image after SpaceToDepth
constexpr int kStemRows = 6;       // of the image's three planes, for one row after SpaceToDepth
constexpr int kChunk = 128;        // of a row's output pixels: what a row of bytes is prepared for at a time

/// Output pixels [begin, end) of a row: channel c of pixel x is from[c][x * step]. Inlined where channels and step are constants,
/// so that a pixel is a few loads and stores without a loop.
inline __attribute__((always_inline)) void gather_floats(const float* const* from, int channels, int step, int width, float* out) {
  for (int x = 0; x < width; ++x) {
    for (int c = 0; c < channels; ++c) {
      out[x * channels + c] = from[c][x * step];
    }
  }
}

void interleave(const float* __restrict planes, int channels, int height, int width, int step, float* __restrict out) {
  const int out_channels = channels * step * step;
  const int out_width = width / step;
  for (int y = 0; y < height / step; ++y) {
    float* const row = out + static_cast<std::size_t>(y * out_width) * static_cast<std::size_t>(out_channels);
    const float* const in = planes + static_cast<std::size_t>(y * step * width);
    if (out_channels == kStemChannels && step == 2) {
      const float* from[kStemChannels];
      for (int c = 0; c < kStemChannels; ++c) {
        from[c] = in + first_element(c, channels, height, width);
      }
      gather_floats(from, kStemChannels, 2, out_width, row);
      continue;
    }
    for (int c = 0; c < out_channels; ++c) {
      const float* const from = in + first_element(c, channels, height, width);
      for (int x = 0; x < out_width; ++x) {
        row[x * out_channels + c] = from[x * step];
      }
    }
  }
}

/// Steps of `count` values: contiguous, so that the compiler vectorises it.
inline void to_steps(const float* __restrict in, int count, float factor, float offset, std::uint8_t* __restrict out) {
  for (int i = 0; i < count; ++i) {
    out[i] = to_u8(in[i] * factor + offset);
  }
}

/// Interleaves rows of a stem: planes of the even row, then of the odd one; even and odd columns in turn.
inline void gather_stem(const std::uint8_t (*steps)[2 * kChunk], int count, std::uint8_t* __restrict out) {
  for (int x = 0; x < count; ++x) {
    for (int column = 0; column < 2; ++column) {
      for (int i = 0; i < kStemRows; ++i) {
        out[x * kStemChannels + column * kStemRows + i] = steps[i][2 * x + column];
      }
    }
  }
}

void interleave_u8(const float* __restrict planes, int channels, int height, int width, int step, Quantization to,
                   std::uint8_t* __restrict out) {
  const int out_channels = channels * step * step;
  const int out_width = width / step;
  const float factor = 1.0F / to.scale;
  const auto offset = static_cast<float>(to.zero_point);
  const bool is_stem = out_channels == kStemChannels && step == 2;
  std::uint8_t steps[kStemRows][2 * kChunk];
  for (int y = 0; y < height / step; ++y) {
    std::uint8_t* const row = out + static_cast<std::size_t>(y * out_width) * static_cast<std::size_t>(out_channels);
    for (int first = 0; first < out_width; first += kChunk) {
      const int count = out_width - first < kChunk ? out_width - first : kChunk;
      std::uint8_t* const pixels = row + first * out_channels;
      // One row of one plane holds the values of `step` output channels in turn.
      for (int i = 0; i < channels * step; ++i) {
        const int plane = i % channels;
        const int in_row = i / channels;
        std::uint8_t* const of_row = steps[is_stem ? i : 0];
        to_steps(planes + static_cast<std::size_t>((plane * height + y * step + in_row) * width + first * step), count * step,
                 factor, offset, of_row);
        for (int column = 0; column < step && !is_stem; ++column) {
          std::uint8_t* const to_channel = pixels + (column * step + in_row) * channels + plane;
          for (int x = 0; x < count; ++x) {
            to_channel[x * out_channels] = of_row[x * step + column];
          }
        }
      }
      if (is_stem) {
        gather_stem(steps, count, pixels);
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
      maxima[c] = larger(pixel[c], maxima[c]);
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
      // Pairwise, so that no addition waits for all before it.
      const Quad s = folded_sum(sums);
      const Quad m = folded_maximum(best);
      sum = (s[0] + s[2]) + (s[1] + s[3]);
      maximum = larger(larger(m[0], m[2]), larger(m[1], m[3]));
    }
    for (std::size_t c = whole; c < channels; ++c) {
      y[c] = x[c] * gates[c];
      sum += y[c];
      maximum = larger(y[c], maximum);
    }
    means[p] = sum * inverse;
    maxima[p] = maximum;
  }
}

/// `blocks` vectors of results side by side, all sums in registers; inlined with a constant.
inline __attribute__((always_inline)) void correlate_blocks(const float* means, const float* maxima, std::size_t stride,
                                                            const float* weights, std::size_t kernel, float bias, int blocks,
                                                            float* out) {
  Floats sums[4];
  for (int block = 0; block < blocks; ++block) {
    sums[block] = Floats{} + bias;
  }
  for (std::size_t plane = 0; plane < 2; ++plane) {
    const float* const of_plane = weights + plane * kernel * kernel;
    for (std::size_t i = 0; i < kernel; ++i) {
      const float* const from = (plane == 0 ? means : maxima) + i * stride;
      for (std::size_t j = 0; j < kernel; ++j) {
        const Floats weight = Floats{} + of_plane[i * kernel + j];
        for (int block = 0; block < blocks; ++block) {
          sums[block] += weight * load(from + j + static_cast<std::size_t>(block) * kLanes);
        }
      }
    }
  }
  for (int block = 0; block < blocks; ++block) {
    store(sums[block], out + static_cast<std::size_t>(block) * kLanes);
  }
}

void correlate_row(const float* means, const float* maxima, std::size_t stride, const float* weights, std::size_t kernel,
                   float bias, std::size_t width, float* out) {
  std::size_t x = 0;
  for (; x + 4 * kLanes <= width; x += 4 * kLanes) {
    correlate_blocks(means + x, maxima + x, stride, weights, kernel, bias, 4, out + x);
  }
  for (; x + kLanes <= width; x += kLanes) {
    correlate_blocks(means + x, maxima + x, stride, weights, kernel, bias, 1, out + x);
  }
  for (; x < width; ++x) {
    float sum = bias;
    for (std::size_t i = 0; i < kernel * kernel; ++i) {
      const std::size_t place = (i / kernel) * stride + x + i % kernel;
      sum += weights[i] * means[place] + weights[kernel * kernel + i] * maxima[place];
    }
    out[x] = sum;
  }
}

/// exp(x) for x in [-87, 87] as 2^n exp(r), |r| <= ln(2) / 2, with the Taylor series of exp(r): relative error below 3e-7.
inline float exponential(float x) {
  constexpr float kLog2E = 1.44269504F;
  constexpr float kLn2High = 0.693359375F;  // few enough bits that its product with n is exact
  constexpr float kLn2Low = -2.12194440e-4F;
  const float low = x < -87.0F ? -87.0F : x;
  const float inside = low < 87.0F ? low : 87.0F;                            // also what is no number, which no integer could hold
  const auto n = static_cast<std::int32_t>(inside * kLog2E + 126.5F) - 126;  // rounds, as what it truncates is positive
  const auto whole = static_cast<float>(n);
  const float r = (inside - whole * kLn2High) - whole * kLn2Low;
  float series = 1.0F / 5040;
  series = series * r + 1.0F / 720;
  series = series * r + 1.0F / 120;
  series = series * r + 1.0F / 24;
  series = series * r + 1.0F / 6;
  series = series * r + 0.5F;
  series = series * r + 1.0F;
  series = series * r + 1.0F;
  const std::int32_t bits = (n + 127) << 23;
  float power = 0;
  __builtin_memcpy(&power, &bits, sizeof power);
  return series * power;
}

void sigmoid(float* __restrict values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    values[i] = 1.0F / (1.0F + exponential(-values[i]));
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
                                     gate_channels, correlate_row, sigmoid,      gate_pixels};

}  // namespace posed
