#pragma once

#include <cstdint>
#include <vector>

#include "core/image_view.h"
#include "slam/kernels/orb_kernels.h"

namespace posed {

/// Corner of one pyramid level.
struct Corner {
  std::uint16_t x = 0;  ///< pixels of the level
  std::uint16_t y = 0;
  std::uint16_t score = 0;  ///< FAST score [grey levels], at least 1: the largest threshold at which it is a corner, plus 1
};

/// Finds FAST-9/16 corners that are 3x3 maxima of the score. A cell of 32x32 pixels keeps the corners of the first threshold or, if
/// it has none, those of the second. Allocates at construction only. Reentrant.
class CornerDetector {
 public:
  static constexpr int kCellSize = 32;

  /// `border`: distance from the image's border within which no corner is looked for, above kFastRadius [pixels].
  CornerDetector(int max_width, int border, int threshold, int threshold_minimum, const OrbKernels& kernels);

  /// Appends nothing but replaces `corners`, in the order of cell rows and within those in reading order. `corners` must have room
  /// for `max_corners` of the image's size, then nothing is allocated.
  void detect(ImageView<const std::uint8_t> image, std::vector<Corner>& corners);

  /// Most corners that an image can have: one in each block of 2x2 pixels.
  static std::size_t max_corners(int width, int height) {
    return static_cast<std::size_t>((width + 1) / 2) * static_cast<std::size_t>((height + 1) / 2);
  }

 private:
  void append_row(ImageView<const std::uint8_t> image, int y, std::vector<Corner>& corners);
  void close_cells(std::size_t first, std::vector<Corner>& corners);
  std::uint8_t* scores(int y) { return scores_.data() + (y % 3) * score_stride_; }

  const OrbKernels* kernels_;
  int border_;
  int threshold_;
  int threshold_minimum_;
  std::ptrdiff_t score_stride_;
  std::vector<std::uint8_t> scores_;        ///< three rows
  std::vector<std::uint16_t> columns_;      ///< of the maxima of one row
  std::vector<std::uint8_t> strong_cells_;  ///< of the present row of cells: has a corner of the first threshold
};

}  // namespace posed
