#pragma once

#include <cstddef>
#include <cstdint>

#include "core/simd_level.h"

namespace posed {

/// Kernels process whole vectors and so may read and write up to this many elements past the end of a row; rows leave that much
/// room.
constexpr int kRowSlack = 64 + 16;

/// Radius of the circle that FAST looks at [pixels].
constexpr int kFastRadius = 3;

/// Radius of the disc over which the orientation is taken, and of the disc in which the descriptor's tests lie [pixels].
constexpr int kPatchRadius = 15;

/// Taps of the Gaussian (sigma 2) that smooths the image before the descriptor's tests; they add up to 256.
constexpr int kBlurTaps = 7;
constexpr std::uint16_t kBlurWeights[kBlurTaps] = {18, 34, 48, 56, 48, 34, 18};

/// Where the columns of a downsized row come from: out[x] lies between source[x] and source[x] + 1.
struct ResizeColumns {
  const int* source;           ///< left neighbour
  const std::int16_t* weight;  ///< of the right neighbour, in 1/32768
  /// For each group of 8 columns, where its first neighbour is: byte offsets of the left neighbours, each followed by 0x80, which
  /// is how byte shuffles are told to write 0. Null if a group spans more than 16 bytes.
  const std::uint8_t* shuffle;
};

/// The hot loops of the ORB extractor for one instruction set. All are integer arithmetic with one specified result; the
/// definitions below are what the tests compare each of them with. Reentrant; they neither allocate nor lock.
struct OrbKernels {
  /// out[x] = 64 a + floor(128 (b - a) weight[x] / 65536), with a = row[source[x]] and b = row[source[x] + 1]: grey levels in 1/64.
  void (*resize_horizontal)(const std::uint8_t* row, const ResizeColumns& columns, int width, std::int16_t* out);

  /// out[x] = floor((upper[x] + floor(2 (lower[x] - upper[x]) weight / 65536) + 32) / 64).
  void (*resize_vertical)(const std::int16_t* upper, const std::int16_t* lower, std::int16_t weight, int width, std::uint8_t* out);

  /// FAST-9/16: for x in [begin, end), scores[x] = 1 + the largest threshold t at which 9 contiguous pixels of the circle around
  /// row[x] are all brighter than row[x] + t or all darker than row[x] - t; 0 where that is below `minimum`. False if all scores
  /// are 0.
  bool (*fast_scores)(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, std::uint8_t minimum,
                      std::uint8_t* scores);

  /// Writes the x in [begin, end) at which the score is positive and a maximum of its 3x3 neighbourhood, in ascending order, and
  /// returns their number. Of equal neighbours the first in reading order counts as the maximum.
  int (*suppress_non_maxima)(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below, int begin, int end,
                             std::uint16_t* columns);

  /// 7x7 Gaussian: `rows` are the 7 rows around the row wanted. Vertically, then horizontally, (sum + 128) / 256 each time; beyond
  /// its ends a row is continued by reflection about the first and last pixel. `scratch` holds width + 2 * kRowSlack bytes.
  void (*blur_row)(const std::uint8_t* const* rows, int width, std::uint8_t* scratch, std::uint8_t* out);

  /// First moments of the grey levels over the disc of kPatchRadius around `centre`, whose rows end as in `disc_half_width`.
  void (*moments)(const std::uint8_t* centre, std::ptrdiff_t stride, int* m10, int* m01);

  /// Bit i of the 256 says whether centre[offsets[2 i]] < centre[offsets[2 i + 1]].
  void (*describe)(const std::uint8_t* centre, const std::int16_t* offsets, std::uint64_t* words);
};

/// Half width of the disc's row `v` from its centre's row, |v| <= kPatchRadius.
int disc_half_width(int v);

/// The kernels of one of `supported_simd_levels()`. Reentrant.
const OrbKernels& orb_kernels(SimdLevel level);

namespace kernels {

/// Ones where the disc of `OrbKernels::moments` is, for rows 0 to 15 and columns -15 to 16.
struct DiscMask {
  std::uint16_t row[kPatchRadius + 1][32];
};
extern const DiscMask kDiscMask;

extern const OrbKernels kOrbBaseline;
#ifdef __x86_64__
extern const OrbKernels kOrbAvx2;
extern const OrbKernels kOrbAvx512;
#endif

}  // namespace kernels
}  // namespace posed
