#include "slam/orb_corners.h"

#include <algorithm>
#include <cassert>

namespace posed {

CornerDetector::CornerDetector(int max_width, int border, int threshold, int threshold_minimum, const OrbKernels& kernels)
    : kernels_(&kernels),
      border_(border),
      threshold_(threshold),
      threshold_minimum_(std::min(threshold, threshold_minimum)),
      score_stride_(max_width + kRowSlack),
      scores_(3 * static_cast<std::size_t>(score_stride_)),
      columns_(static_cast<std::size_t>(max_width)),
      strong_cells_(static_cast<std::size_t>(max_width / kCellSize + 1)) {
  assert(border > kFastRadius && threshold_minimum_ >= 1 && threshold < 255);
  assert(max_width <= UINT16_MAX);
}

void CornerDetector::detect(ImageView<const std::uint8_t> image, std::vector<Corner>& corners) {
  corners.clear();
  const int top = border_;
  const int bottom = image.height - border_;
  if (bottom <= top || image.width <= 2 * border_) {
    return;
  }
  // Scores are computed one pixel beyond the region in each direction, so that also its outermost corners are compared with all of
  // their neighbours. `y` runs one row ahead of the row whose maxima are taken.
  const auto minimum = static_cast<std::uint8_t>(threshold_minimum_ + 1);
  const auto compute_scores = [&](int y) {
    return kernels_->fast_scores(image.row(y), image.stride, border_ - 1, image.width - border_ + 1, minimum, scores(y));
  };
  compute_scores(top - 1);
  bool row_has_scores = compute_scores(top);
  for (int cells_top = top; cells_top < bottom; cells_top += kCellSize) {
    const std::size_t first = corners.size();
    std::fill(strong_cells_.begin(), strong_cells_.end(), std::uint8_t{0});
    const int cells_bottom = std::min(cells_top + kCellSize, bottom);
    for (int y = cells_top; y < cells_bottom; ++y) {
      const bool next_row_has_scores = compute_scores(y + 1);
      if (row_has_scores) {
        append_row(image, y, corners);
      }
      row_has_scores = next_row_has_scores;
    }
    close_cells(first, corners);
  }
}

void CornerDetector::append_row(ImageView<const std::uint8_t> image, int y, std::vector<Corner>& corners) {
  const std::uint8_t* row = scores(y);
  const int count =
      kernels_->suppress_non_maxima(scores(y + 2), row, scores(y + 1), border_, image.width - border_, columns_.data());
  for (int i = 0; i < count; ++i) {
    const std::uint16_t x = columns_[static_cast<std::size_t>(i)];
    corners.push_back({x, static_cast<std::uint16_t>(y), row[x]});
    if (row[x] > threshold_) {
      strong_cells_[static_cast<std::size_t>((x - border_) / kCellSize)] = 1;
    }
  }
}

void CornerDetector::close_cells(std::size_t first, std::vector<Corner>& corners) {
  std::size_t kept = first;
  for (std::size_t i = first; i < corners.size(); ++i) {
    const Corner corner = corners[i];
    if (corner.score > threshold_ || strong_cells_[static_cast<std::size_t>((corner.x - border_) / kCellSize)] == 0) {
      corners[kept++] = corner;
    }
  }
  corners.resize(kept);
}

}  // namespace posed
