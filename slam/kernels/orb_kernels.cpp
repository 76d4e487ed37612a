// Compiled once for each instruction set.
#include "slam/kernels/simd.h"

// The universal intrinsics come first: they are configured by the instruction set.
#include "slam/kernels/orb_kernels.h"

namespace posed::kernels {
namespace {

// Vectors of the widest registers: 16, 32 or 64 bytes.
using cv::v_int16;
using cv::v_store;
using cv::v_uint16;
using cv::v_uint8;
using cv::vx_load;
using cv::vx_load_expand;
using cv::vx_setall_s16;
using cv::vx_setall_u16;
using cv::vx_setall_u8;
using cv::vx_setzero_s16;
using cv::vx_setzero_u8;

// A sign mask has a bit for each lane; that of 32 lanes comes sign-extended.
constexpr std::uint64_t kLaneBits = ~std::uint64_t{0} >> (64 - v_uint8::nlanes);

inline v_int16 signed_16(const v_uint16& v) {
  return cv::v_reinterpret_as_s16(v);
}

// --- Resizing
// ---------------------------------------------------------------------------------------------------------------------

inline v_int16 between(const v_int16& left, const v_int16& right, const v_int16& weight) {
  return (left << 6) + cv::v_mul_hi((right - left) << 7, weight);
}

void resize_horizontal_gather(const std::uint8_t* row, const ResizeColumns& columns, int width, std::int16_t* out) {
  for (int x = 0; x < width; x += v_uint8::nlanes) {
    v_uint16 left_low, left_high, right_low, right_high;
    cv::v_expand(cv::vx_lut(row, columns.source + x), left_low, left_high);
    cv::v_expand(cv::vx_lut(row + 1, columns.source + x), right_low, right_high);
    const v_int16 low = between(signed_16(left_low), signed_16(right_low), vx_load(columns.weight + x));
    const v_int16 high = between(signed_16(left_high), signed_16(right_high), vx_load(columns.weight + x + v_int16::nlanes));
    v_store(out + x, low);
    v_store(out + x + v_int16::nlanes, high);
  }
}

#if CV_AVX2
// Gathering is slow; a shuffle of 16 bytes fetches 8 columns at a time. The universal intrinsics have no such shuffle.
void resize_horizontal(const std::uint8_t* row, const ResizeColumns& columns, int width, std::int16_t* out) {
  if (columns.shuffle == nullptr) {
    resize_horizontal_gather(row, columns, width, out);
    return;
  }
  const auto load_128 = [](const std::uint8_t* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)); };
  const __m256i next = _mm256_set1_epi16(1);
  for (int x = 0; x < width; x += 16) {
    const __m256i pixels = _mm256_set_m128i(load_128(row + columns.source[x + 8]), load_128(row + columns.source[x]));
    const __m256i shuffle = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(columns.shuffle + 2 * x));
    const cv::v_int16x16 left(_mm256_shuffle_epi8(pixels, shuffle));
    const cv::v_int16x16 right(_mm256_shuffle_epi8(pixels, _mm256_add_epi16(shuffle, next)));
    const cv::v_int16x16 weight = cv::v256_load(columns.weight + x);
    cv::v_store(out + x, (left << 6) + cv::v_mul_hi((right - left) << 7, weight));
  }
}
#else
void resize_horizontal(const std::uint8_t* row, const ResizeColumns& columns, int width, std::int16_t* out) {
  resize_horizontal_gather(row, columns, width, out);
}
#endif

void resize_vertical(const std::int16_t* upper, const std::int16_t* lower, std::int16_t weight, int width, std::uint8_t* out) {
  const v_int16 weights = vx_setall_s16(weight);
  const v_int16 half = vx_setall_s16(32);
  const auto blend = [&](int x) {
    const v_int16 top = vx_load(upper + x);
    return (top + cv::v_mul_hi((vx_load(lower + x) - top) << 1, weights) + half) >> 6;
  };
  for (int x = 0; x < width; x += v_uint8::nlanes) {
    v_store(out + x, cv::v_pack_u(blend(x), blend(x + v_int16::nlanes)));
  }
}

// --- FAST
// -------------------------------------------------------------------------------------------------------------------------

// The circle of FAST, clockwise from the top.
constexpr int kCircle[16][2] = {{0, -3}, {1, -3}, {2, -2}, {3, -1}, {3, 0},  {3, 1},   {2, 2},   {1, 3},
                                {0, 3},  {-1, 3}, {-2, 2}, {-3, 1}, {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};

// Extremes over arcs: the largest minimum and the smallest maximum that 9 contiguous of the 16 pixels have. The two arcs that share
// the 8 pixels i .. i + 7 differ in one end pixel, so max(min(m, p[i - 1]), min(m, p[i + 8])) = min(m, max(p[i - 1], p[i + 8])).
inline void arc_extremes(const v_uint8* p, v_uint8& largest_minimum, v_uint8& smallest_maximum) {
  v_uint8 minimum_2[8], maximum_2[8], minimum_4[8], maximum_4[8];
  for (int i = 0; i < 8; ++i) {
    minimum_2[i] = cv::v_min(p[2 * i], p[2 * i + 1]);
    maximum_2[i] = cv::v_max(p[2 * i], p[2 * i + 1]);
  }
  for (int i = 0; i < 8; ++i) {
    minimum_4[i] = cv::v_min(minimum_2[i], minimum_2[(i + 1) % 8]);
    maximum_4[i] = cv::v_max(maximum_2[i], maximum_2[(i + 1) % 8]);
  }
  for (int i = 0; i < 8; ++i) {
    const v_uint8& before = p[(2 * i + 15) % 16];
    const v_uint8& after = p[(2 * i + 8) % 16];
    const v_uint8 minimum = cv::v_min(cv::v_min(minimum_4[i], minimum_4[(i + 2) % 8]), cv::v_max(before, after));
    const v_uint8 maximum = cv::v_max(cv::v_max(maximum_4[i], maximum_4[(i + 2) % 8]), cv::v_min(before, after));
    largest_minimum = i == 0 ? minimum : cv::v_max(largest_minimum, minimum);
    smallest_maximum = i == 0 ? maximum : cv::v_min(smallest_maximum, maximum);
  }
}

bool fast_scores(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, std::uint8_t minimum, std::uint8_t* scores) {
  std::ptrdiff_t offsets[16];
  for (int i = 0; i < 16; ++i) {
    offsets[i] = kCircle[i][1] * stride + kCircle[i][0];
  }
  const v_uint8 minimums = vx_setall_u8(minimum);
  bool any = false;
  for (int x = begin; x < end; x += v_uint8::nlanes) {
    const std::uint8_t* centre = row + x;
    const v_uint8 c = vx_load(centre);
    // Every arc of 9 covers two neighbours of the circle's top, right, bottom and left pixel, which bounds the score.
    const v_uint8 top = vx_load(centre + offsets[0]);
    const v_uint8 right = vx_load(centre + offsets[4]);
    const v_uint8 bottom = vx_load(centre + offsets[8]);
    const v_uint8 left = vx_load(centre + offsets[12]);
    const v_uint8 brighter = cv::v_min(cv::v_max(top, bottom), cv::v_max(left, right)) - c;
    const v_uint8 darker = c - cv::v_max(cv::v_min(top, bottom), cv::v_min(left, right));
    if (!cv::v_check_any(cv::v_max(brighter, darker) >= minimums)) {
      v_store(scores + x, vx_setzero_u8());
      continue;
    }
    v_uint8 p[16];
    for (int i = 0; i < 16; ++i) {
      p[i] = vx_load(centre + offsets[i]);
    }
    v_uint8 largest_minimum, smallest_maximum;
    arc_extremes(p, largest_minimum, smallest_maximum);
    const v_uint8 score = cv::v_max(largest_minimum - c, c - smallest_maximum);
    v_store(scores + x, score & (score >= minimums));
    any = true;
  }
  return any;
}

int suppress_non_maxima(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below, int begin, int end,
                        std::uint16_t* columns) {
  int count = 0;
  const v_uint8 zero = vx_setzero_u8();
  for (int x = begin; x < end; x += v_uint8::nlanes) {
    const v_uint8 score = vx_load(scores + x);
    if (!cv::v_check_any(score > zero)) {
      continue;
    }
    const v_uint8 before = cv::v_max(cv::v_max(vx_load(above + x - 1), vx_load(above + x)),
                                     cv::v_max(vx_load(above + x + 1), vx_load(scores + x - 1)));
    const v_uint8 after = cv::v_max(cv::v_max(vx_load(below + x - 1), vx_load(below + x)),
                                    cv::v_max(vx_load(below + x + 1), vx_load(scores + x + 1)));
    std::uint64_t mask = static_cast<std::uint64_t>(cv::v_signmask((score > before) & (score >= after))) & kLaneBits;
    if (end - x < v_uint8::nlanes) {
      mask &= (std::uint64_t{1} << (end - x)) - 1;
    }
    for (; mask != 0; mask &= mask - 1) {
      columns[count++] = static_cast<std::uint16_t>(x + __builtin_ctzll(mask));
    }
  }
  return count;
}

// --- Smoothing
// --------------------------------------------------------------------------------------------------------------------

// 7 taps on one vector of 16-bit lanes; `tap(i)` loads the i-th.
template <typename Tap>
inline v_uint16 gaussian(const Tap& tap) {
  v_uint16 sum = cv::v_mul_wrap(tap(3), vx_setall_u16(kBlurWeights[3])) + vx_setall_u16(128);
  for (int i = 0; i < 3; ++i) {
    sum = sum + cv::v_mul_wrap(tap(i) + tap(6 - i), vx_setall_u16(kBlurWeights[i]));
  }
  return sum >> 8;
}

void blur_row(const std::uint8_t* const* rows, int width, std::uint8_t* scratch, std::uint8_t* out) {
  constexpr int kHalf = kBlurTaps / 2;
  std::uint8_t* vertical = scratch + kRowSlack;
  for (int x = 0; x < width; x += v_uint8::nlanes) {
    const auto at = [&](int column) { return gaussian([&](int i) { return vx_load_expand(rows[i] + column); }); };
    v_store(vertical + x, cv::v_pack(at(x), at(x + v_uint16::nlanes)));
  }
  for (int i = 1; i <= kHalf; ++i) {
    vertical[-i] = vertical[i];
    vertical[width - 1 + i] = vertical[width - 1 - i];
  }
  for (int x = 0; x < width; x += v_uint8::nlanes) {
    const auto at = [&](int column) { return gaussian([&](int i) { return vx_load_expand(vertical + column + i - kHalf); }); };
    v_store(out + x, cv::v_pack(at(x), at(x + v_uint16::nlanes)));
  }
}

// --- Orientation and descriptor
// ---------------------------------------------------------------------------------------------------

// Grey levels of 31 columns, 16 bits each, summed over the rows: plainly (at most 31 * 255) and times the row (at most 120 * 255).
void moments(const std::uint8_t* centre, std::ptrdiff_t stride, int* m10, int* m01) {
  alignas(64) static constexpr std::int16_t kColumn[32] = {-15, -14, -13, -12, -11, -10, -9, -8, -7, -6, -5, -4, -3, -2, -1, 0,
                                                           1,   2,   3,   4,   5,   6,   7,  8,  9,  10, 11, 12, 13, 14, 15, 16};
  const std::uint8_t* first = centre - kPatchRadius;
  cv::v_int32 sum_10 = cv::vx_setzero_s32();
  cv::v_int32 sum_01 = cv::vx_setzero_s32();
  const v_int16 ones = vx_setall_s16(1);
  for (int u = 0; u < 32; u += v_int16::nlanes) {
    v_int16 columns = signed_16(vx_load_expand(first + u) & vx_load(kDiscMask.row[0] + u));
    v_int16 by_row = vx_setzero_s16();
    for (int v = 1; v <= kPatchRadius; ++v) {
      const v_int16 mask = signed_16(vx_load(kDiscMask.row[v] + u));
      const v_int16 below = signed_16(vx_load_expand(first + v * stride + u)) & mask;
      const v_int16 above = signed_16(vx_load_expand(first - v * stride + u)) & mask;
      columns = columns + below + above;
      by_row = by_row + cv::v_mul_wrap(below - above, vx_setall_s16(static_cast<std::int16_t>(v)));
    }
    sum_10 = sum_10 + cv::v_dotprod(columns, vx_load(kColumn + u));
    sum_01 = sum_01 + cv::v_dotprod(by_row, ones);
  }
  *m10 = cv::v_reduce_sum(sum_10);
  *m01 = cv::v_reduce_sum(sum_01);
}

// Fetches the pixels one by one, since gathering is slower, and compares them by vectors.
void describe(const std::uint8_t* centre, const std::int16_t* offsets, std::uint64_t* words) {
  alignas(64) std::uint8_t a[64];
  alignas(64) std::uint8_t b[64];
  for (int word = 0; word < 4; ++word) {
    for (int i = 0; i < 64; ++i) {
      a[i] = centre[offsets[2 * i]];
      b[i] = centre[offsets[2 * i + 1]];
    }
    std::uint64_t bits = 0;
    for (int i = 0; i < 64; i += v_uint8::nlanes) {
      const auto mask = cv::v_signmask(vx_load(a + i) < vx_load(b + i));
      bits |= (static_cast<std::uint64_t>(mask) & kLaneBits) << i;
    }
    words[word] = bits;
    offsets += 128;
  }
}

constexpr OrbKernels kKernels{resize_horizontal, resize_vertical, fast_scores, suppress_non_maxima, blur_row, moments, describe};

}  // namespace

#if defined(POSED_KERNELS_AVX512)
const OrbKernels kOrbAvx512 = kKernels;
#elif defined(POSED_KERNELS_AVX2)
const OrbKernels kOrbAvx2 = kKernels;
#else
const OrbKernels kOrbBaseline = kKernels;

#endif

}  // namespace posed::kernels
