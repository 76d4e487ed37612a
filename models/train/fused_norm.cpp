// Batch normalisation and SiLU of a training step in one pass each way, for bfloat16 on a processor. fused_norm.py builds and calls it.
//
// PyTorch takes them one after another, SiLU in float, and writes every step out: on a processor with fast bfloat16 convolutions that is
// more than half of a step's time. Arrays are rows x channels (N, H, W joined: channels last), sums are in float over a few hundred rows
// and in double over those. Reentrant; nothing is checked here.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace {

using Bfloat16 = std::uint16_t;
constexpr std::int64_t kRowsAtOnce = 256;

inline float widened(Bfloat16 v) {
  const std::uint32_t bits = std::uint32_t{v} << 16;
  float f;
  std::memcpy(&f, &bits, sizeof f);
  return f;
}

// Round to nearest, ties to even; what is no number stays none, since the values here are far from the largest.
inline Bfloat16 narrowed(float f) {
  std::uint32_t bits;
  std::memcpy(&bits, &f, sizeof bits);
  return static_cast<Bfloat16>((bits + 0x7fffU + ((bits >> 16) & 1U)) >> 16);
}

inline float sigmoid(float v) { return 1.0F / (1.0F + std::exp(-v)); }

// Two sums of every channel over all rows: `term(row, a, b)` adds a row's values to `a` and `b`, one entry a channel.
template <typename Term>
void sum_rows(std::int64_t rows, std::int64_t channels, double* first, double* second, const Term& term) {
  std::vector<float> partial(static_cast<std::size_t>(2 * channels));
  float* a = partial.data();
  float* b = a + channels;
  std::fill(first, first + channels, 0.0);
  std::fill(second, second + channels, 0.0);
  for (std::int64_t begin = 0; begin < rows; begin += kRowsAtOnce) {
    std::fill(partial.begin(), partial.end(), 0.0F);
    for (std::int64_t row = begin; row < std::min(begin + kRowsAtOnce, rows); ++row) {
      term(row, a, b);
    }
    for (std::int64_t c = 0; c < channels; ++c) {
      first[c] += a[c];
      second[c] += b[c];
    }
  }
}

}  // namespace

// y = act(x * scale + shift) with scale = weight / sqrt(variance + eps) and shift = bias - mean * scale; act is SiLU or nothing. Writes the
// batch's mean and variance (divided by the number of rows).
extern "C" void norm_silu_forward(const Bfloat16* x, const float* weight, const float* bias, float eps, std::int64_t rows, std::int64_t channels,
                                  int with_silu, Bfloat16* y, float* mean, float* variance) {
  const auto n = static_cast<std::size_t>(channels);
  std::vector<double> sum(n);
  std::vector<double> squares(n);
  // Relative to the first row: what a channel's mean is far above its deviation would lose digits otherwise.
  std::vector<float> origin(n);
  for (std::size_t c = 0; c < n; ++c) {
    origin[c] = widened(x[c]);
  }
  const float* o = origin.data();
  sum_rows(rows, channels, sum.data(), squares.data(), [=](std::int64_t row, float* __restrict a, float* __restrict b) {
    const Bfloat16* __restrict in = x + row * channels;
#pragma GCC ivdep
    for (std::int64_t c = 0; c < channels; ++c) {
      const float v = widened(in[c]) - o[c];
      a[c] += v;
      b[c] += v * v;
    }
  });
  std::vector<float> scale(n);
  std::vector<float> shift(n);
  for (std::size_t c = 0; c < n; ++c) {
    const double m = sum[c] / static_cast<double>(rows);
    const double var = std::max(squares[c] / static_cast<double>(rows) - m * m, 0.0);
    mean[c] = static_cast<float>(m + origin[c]);
    variance[c] = static_cast<float>(var);
    scale[c] = weight[c] / std::sqrt(variance[c] + eps);
    shift[c] = bias[c] - mean[c] * scale[c];
  }
  const float* s = scale.data();
  const float* t = shift.data();
  for (std::int64_t row = 0; row < rows; ++row) {
    const Bfloat16* __restrict in = x + row * channels;
    Bfloat16* __restrict out = y + row * channels;
    if (with_silu != 0) {
#pragma GCC ivdep
      for (std::int64_t c = 0; c < channels; ++c) {
        const float z = widened(in[c]) * s[c] + t[c];
        out[c] = narrowed(z * sigmoid(z));
      }
    } else {
#pragma GCC ivdep
      for (std::int64_t c = 0; c < channels; ++c) {
        out[c] = narrowed(widened(in[c]) * s[c] + t[c]);
      }
    }
  }
}

// From the gradient of y those of x, weight and bias; the mean and variance are those of the forward pass.
extern "C" void norm_silu_backward(const Bfloat16* gradient, const Bfloat16* x, const float* weight, const float* bias, const float* mean,
                                   const float* variance, float eps, std::int64_t rows, std::int64_t channels, int with_silu, Bfloat16* dx,
                                   float* dweight, float* dbias) {
  const auto n = static_cast<std::size_t>(channels);
  std::vector<float> scale(n);
  std::vector<float> shift(n);
  std::vector<float> inverse(n);
  for (std::size_t c = 0; c < n; ++c) {
    inverse[c] = 1.0F / std::sqrt(variance[c] + eps);
    scale[c] = weight[c] * inverse[c];
    shift[c] = bias[c] - mean[c] * scale[c];
  }
  const float* s = scale.data();
  const float* t = shift.data();
  const float* i = inverse.data();
  std::vector<double> sum(n);
  std::vector<double> product(n);
  // The first pass leaves the gradient before SiLU in dx.
  sum_rows(rows, channels, sum.data(), product.data(), [=](std::int64_t row, float* __restrict a, float* __restrict b) {
    const Bfloat16* __restrict in = x + row * channels;
    const Bfloat16* __restrict g = gradient + row * channels;
    Bfloat16* __restrict out = dx + row * channels;
    if (with_silu != 0) {
#pragma GCC ivdep
      for (std::int64_t c = 0; c < channels; ++c) {
        const float v = widened(in[c]);
        const float z = v * s[c] + t[c];
        const float p = sigmoid(z);
        const float d = widened(g[c]) * p * (1.0F + z * (1.0F - p));
        out[c] = narrowed(d);
        a[c] += d;
        b[c] += d * (v - mean[c]) * i[c];
      }
    } else {
#pragma GCC ivdep
      for (std::int64_t c = 0; c < channels; ++c) {
        const float d = widened(g[c]);
        out[c] = g[c];
        a[c] += d;
        b[c] += d * (widened(in[c]) - mean[c]) * i[c];
      }
    }
  });
  // dx = scale * (d - mean(d) - (x - mean) / deviation * mean(d * (x - mean) / deviation)), as slope * x + rest
  std::vector<float> slope(n);
  std::vector<float> rest(n);
  for (std::size_t c = 0; c < n; ++c) {
    dbias[c] = static_cast<float>(sum[c]);
    dweight[c] = static_cast<float>(product[c]);
    const auto k = static_cast<float>(product[c] / static_cast<double>(rows)) * inverse[c] * scale[c];
    slope[c] = -k;
    rest[c] = k * mean[c] - scale[c] * static_cast<float>(sum[c] / static_cast<double>(rows));
  }
  const float* k = slope.data();
  const float* r = rest.data();
  for (std::int64_t row = 0; row < rows; ++row) {
    const Bfloat16* __restrict in = x + row * channels;
    Bfloat16* __restrict out = dx + row * channels;
#pragma GCC ivdep
    for (std::int64_t c = 0; c < channels; ++c) {
      out[c] = narrowed(s[c] * widened(out[c]) + k[c] * widened(in[c]) + r[c]);
    }
  }
}
