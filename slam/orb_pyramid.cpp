#include "slam/orb_pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

namespace posed {
namespace {

constexpr std::size_t kAlignment = 64;
constexpr int kShuffleGroup = 8;  ///< columns that one shuffle of 16 bytes yields
constexpr std::uint8_t kShuffleZero = 0x80;

std::vector<PlaneStack::Size> level_sizes(int width, int height, int levels, double scale, int min_size) {
  std::vector<PlaneStack::Size> sizes{{width, height}};
  for (int level = 1; level < levels; ++level) {
    const double factor = std::pow(scale, -level);
    const PlaneStack::Size size{static_cast<int>(std::lround(width * factor)), static_cast<int>(std::lround(height * factor))};
    if (size.width < min_size || size.height < min_size) {
      break;
    }
    sizes.push_back(size);
  }
  return sizes;
}

// Positions between source pixels of the centres of destination pixels. The tables are as long as whole vectors need.
void sample_positions(int from, int to, std::vector<int>& source, std::vector<std::int16_t>& weight) {
  const double ratio = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const double position = (i + 0.5) * ratio - 0.5;
    const int before = static_cast<int>(std::floor(position));
    source.push_back(before);
    weight.push_back(static_cast<std::int16_t>(std::min(std::lround((position - before) * 32768.0), 32767L)));
  }
  source.resize(source.size() + kRowSlack, source.back());
  weight.resize(weight.size() + kRowSlack, 0);
}

// The byte shuffle of ResizeColumns, or nothing if the columns of a group lie too far apart.
std::vector<std::uint8_t> make_shuffle(const std::vector<int>& source) {
  std::vector<std::uint8_t> shuffle;
  for (std::size_t x = 0; x < source.size(); ++x) {
    const int offset = source[x] - source[x - x % kShuffleGroup];
    if (offset + 1 >= 16) {
      return {};
    }
    shuffle.push_back(static_cast<std::uint8_t>(offset));
    shuffle.push_back(kShuffleZero);
  }
  return shuffle;
}

int reflect(int i, int size) {
  if (size == 1) {
    return 0;
  }
  while (i < 0 || i >= size) {
    i = i < 0 ? -i : 2 * (size - 1) - i;
  }
  return i;
}

}  // namespace

void PlaneStack::AlignedDelete::operator()(std::uint8_t* p) const noexcept {
  ::operator delete[](p, std::align_val_t{kAlignment});
}

PlaneStack::PlaneStack(const std::vector<Size>& sizes) {
  int widest = 0;
  int rows = 0;
  for (const Size& size : sizes) {
    widest = std::max(widest, size.width);
    rows += size.height;
  }
  const auto alignment = static_cast<std::ptrdiff_t>(kAlignment);
  stride_ = (widest + kRowSlack + alignment - 1) / alignment * alignment;
  const std::size_t bytes = static_cast<std::size_t>(stride_ * rows);
  pixels_.reset(new (std::align_val_t{kAlignment}) std::uint8_t[bytes]);
  std::memset(pixels_.get(), 0, bytes);
  std::uint8_t* top = pixels_.get();
  for (const Size& size : sizes) {
    planes_.push_back({top, size.width, size.height, stride_, 1});
    top += stride_ * size.height;
  }
}

OrbPyramid::OrbPyramid(int width, int height, int levels, double scale, int min_size, const OrbKernels& kernels)
    : kernels_(&kernels) {
  assert(width > kBlurTaps && height > kBlurTaps && levels > 0 && scale > 1.0);
  const std::vector<PlaneStack::Size> sizes = level_sizes(width, height, levels, scale, min_size);
  images_ = PlaneStack(sizes);
  smoothed_ = PlaneStack(sizes);
  resampling_.emplace_back();
  for (std::size_t level = 1; level < sizes.size(); ++level) {
    resampling_.push_back(make_resampling(sizes[level - 1], sizes[level]));
  }
  resized_rows_.resize(2 * static_cast<std::size_t>(images_.stride()));
  blur_scratch_.resize(static_cast<std::size_t>(width + 2 * kRowSlack));
}

OrbPyramid::Resampling OrbPyramid::make_resampling(const PlaneStack::Size& from, const PlaneStack::Size& to) {
  Resampling resampling;
  sample_positions(from.width, to.width, resampling.columns, resampling.column_weights);
  sample_positions(from.height, to.height, resampling.rows, resampling.row_weights);
  resampling.shuffle = make_shuffle(resampling.columns);
  return resampling;
}

void OrbPyramid::set_image(ImageView<const std::uint8_t> gray) {
  const ImageView<std::uint8_t> level = images_.plane(0);
  assert(gray.width == level.width && gray.height == level.height && gray.channels == 1);
  for (int y = 0; y < level.height; ++y) {
    std::memcpy(level.row(y), gray.row(y), static_cast<std::size_t>(level.width));
  }
}

void OrbPyramid::resize_to(int level) {
  const Resampling& resampling = resampling_[static_cast<std::size_t>(level)];
  const ImageView<std::uint8_t> from = images_.plane(level - 1);
  const ImageView<std::uint8_t> to = images_.plane(level);
  const ResizeColumns columns{resampling.columns.data(), resampling.column_weights.data(),
                              resampling.shuffle.empty() ? nullptr : resampling.shuffle.data()};
  // Every source row is resized horizontally once, into the half of the scratch that its parity names.
  int next_row = 0;
  const auto resized = [&](int row) { return resized_rows_.data() + (row % 2) * images_.stride(); };
  for (int y = 0; y < to.height; ++y) {
    const int upper = resampling.rows[static_cast<std::size_t>(y)];
    const int lower = std::min(upper + 1, from.height - 1);
    for (next_row = std::max(next_row, upper); next_row <= lower; ++next_row) {
      kernels_->resize_horizontal(from.row(next_row), columns, to.width, resized(next_row));
    }
    kernels_->resize_vertical(resized(upper), resized(lower), resampling.row_weights[static_cast<std::size_t>(y)], to.width,
                              to.row(y));
  }
}

void OrbPyramid::smooth(int level) {
  const ImageView<std::uint8_t> from = images_.plane(level);
  const ImageView<std::uint8_t> to = smoothed_.plane(level);
  const std::uint8_t* rows[kBlurTaps];
  for (int y = 0; y < from.height; ++y) {
    for (int i = 0; i < kBlurTaps; ++i) {
      rows[i] = from.row(reflect(y + i - kBlurTaps / 2, from.height));
    }
    kernels_->blur_row(rows, from.width, blur_scratch_.data(), to.row(y));
  }
}

}  // namespace posed
