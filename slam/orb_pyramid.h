#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/image_view.h"
#include "slam/kernels/orb_kernels.h"

namespace posed {

/// Grey-level images that share one row stride, so that a table of pixel offsets holds for all of them. Rows are followed by at
/// least kRowSlack bytes that may be overwritten. Reentrant.
class PlaneStack {
 public:
  PlaneStack() = default;
  /// One plane for each (width, height).
  struct Size {
    int width;
    int height;
  };
  explicit PlaneStack(const std::vector<Size>& sizes);

  ImageView<std::uint8_t> plane(int i) const { return planes_[static_cast<std::size_t>(i)]; }
  int count() const { return static_cast<int>(planes_.size()); }
  std::ptrdiff_t stride() const { return stride_; }

 private:
  struct AlignedDelete {
    void operator()(std::uint8_t* p) const noexcept;
  };
  std::unique_ptr<std::uint8_t[], AlignedDelete> pixels_;
  std::vector<ImageView<std::uint8_t>> planes_;
  std::ptrdiff_t stride_ = 0;
};

/// Image pyramid: level 0 is the image, and each level is its finer neighbour made smaller bilinearly by `scale`; with each level
/// its smoothed copy (7x7 Gaussian, sigma 2, reflected at the borders). All memory is allocated at construction. Reentrant.
class OrbPyramid {
 public:
  /// Levels that would be smaller than `min_size` in width or height are left out, but not the first.
  OrbPyramid(int width, int height, int levels, double scale, int min_size, const OrbKernels& kernels);

  int level_count() const { return images_.count(); }
  ImageView<std::uint8_t> image(int level) const { return images_.plane(level); }
  ImageView<std::uint8_t> smoothed(int level) const { return smoothed_.plane(level); }
  std::ptrdiff_t stride() const { return images_.stride(); }

  /// Copies `gray`, whose size is that of construction, into level 0.
  void set_image(ImageView<const std::uint8_t> gray);
  /// Makes `level` (above 0) from the level before it.
  void resize_to(int level);
  /// Makes the smoothed copy of `level`.
  void smooth(int level);

 private:
  struct Resampling {
    std::vector<int> columns;
    std::vector<std::int16_t> column_weights;
    std::vector<std::uint8_t> shuffle;
    std::vector<int> rows;
    std::vector<std::int16_t> row_weights;
  };
  static Resampling make_resampling(const PlaneStack::Size& from, const PlaneStack::Size& to);

  const OrbKernels* kernels_;
  PlaneStack images_;
  PlaneStack smoothed_;
  std::vector<Resampling> resampling_;      ///< of level i from level i - 1; the first is empty
  std::vector<std::int16_t> resized_rows_;  ///< two rows that are resized horizontally
  std::vector<std::uint8_t> blur_scratch_;
};

}  // namespace posed
