#include "detect/letterbox.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace posed {

namespace {

constexpr int kChannels = 3;

}  // namespace

Letterbox::Letterbox(TensorShape input, PixelFormat format) : input_(input), format_(format) {
  assert(input.channels == kChannels);
}

/// Weights by which `source` pixels become `target` pixels: of an area where it shrinks, of the two nearest where it grows.
Letterbox::Axis Letterbox::make_axis(int source, int target) {
  Axis axis;
  const double step = static_cast<double>(source) / target;
  for (int i = 0; i < target; ++i) {
    // The span of source coordinates that counts: the target pixel's own, but never less than one source pixel wide.
    const double centre = (i + 0.5) * step;
    const double half = 0.5 * std::max(step, 1.0);
    const double begin = std::max(centre - half, 0.0);
    const double end = std::min(centre + half, static_cast<double>(source));
    const int first = static_cast<int>(std::floor(begin));
    const int last = std::min(static_cast<int>(std::ceil(end)), source);
    Taps taps{first, last - first, static_cast<int>(axis.weights.size())};
    for (int s = first; s < last; ++s) {
      const double covered = std::min(end, s + 1.0) - std::max(begin, static_cast<double>(s));
      axis.weights.push_back(static_cast<float>(covered / (end - begin)));
    }
    axis.taps.push_back(taps);
  }
  return axis;
}

void Letterbox::prepare(int width, int height) {
  if (width == image_width_ && height == image_height_) {
    return;
  }
  image_width_ = width;
  image_height_ = height;
  const double scale = std::min(static_cast<double>(input_.width) / width, static_cast<double>(input_.height) / height);
  resized_width_ = std::clamp(static_cast<int>(std::lround(width * scale)), 1, input_.width);
  resized_height_ = std::clamp(static_cast<int>(std::lround(height * scale)), 1, input_.height);
  left_ = (input_.width - resized_width_) / 2;
  top_ = (input_.height - resized_height_) / 2;
  columns_ = make_axis(width, resized_width_);
  rows_ = make_axis(height, resized_height_);
  source_row_.resize(static_cast<std::size_t>(width) * kChannels);
}

/// `source_row_` becomes row `y` of the resized image, not yet resized across.
void Letterbox::resize_row(ImageView<const std::uint8_t> bgr, int y) {
  const Taps& taps = rows_.taps[static_cast<std::size_t>(y)];
  const std::size_t values = source_row_.size();
  float* const out = source_row_.data();
  for (int t = 0; t < taps.count; ++t) {
    const float weight = rows_.weights[static_cast<std::size_t>(taps.weights + t)] * format_.scale;
    const std::uint8_t* const in = bgr.row(taps.first + t);
    if (t == 0) {
      for (std::size_t i = 0; i < values; ++i) {
        out[i] = weight * static_cast<float>(in[i]);
      }
    } else {
      for (std::size_t i = 0; i < values; ++i) {
        out[i] += weight * static_cast<float>(in[i]);
      }
    }
  }
}

void Letterbox::place(ImageView<const std::uint8_t> bgr, std::span<float> planes) {
  assert(planes.size() == input_.size() && bgr.channels == kChannels && bgr.width > 0 && bgr.height > 0);
  prepare(bgr.width, bgr.height);
  const std::size_t plane = static_cast<std::size_t>(input_.width) * static_cast<std::size_t>(input_.height);
  std::fill(planes.begin(), planes.end(), format_.scale * static_cast<float>(format_.border));
  float* const red = planes.data() + (format_.rgb ? 0 : 2 * plane);
  float* const green = planes.data() + plane;
  float* const blue = planes.data() + (format_.rgb ? 2 * plane : 0);
  for (int y = 0; y < resized_height_; ++y) {
    resize_row(bgr, y);
    std::size_t out = static_cast<std::size_t>(top_ + y) * static_cast<std::size_t>(input_.width) + static_cast<std::size_t>(left_);
    for (const Taps& taps : columns_.taps) {
      const float* const weights = columns_.weights.data() + taps.weights;
      const float* in = source_row_.data() + static_cast<std::ptrdiff_t>(taps.first) * kChannels;
      float b = 0;
      float g = 0;
      float r = 0;
      for (int t = 0; t < taps.count; ++t, in += kChannels) {
        b += weights[t] * in[0];
        g += weights[t] * in[1];
        r += weights[t] * in[2];
      }
      blue[out] = b;
      green[out] = g;
      red[out] = r;
      ++out;
    }
  }
}

BoundingBox Letterbox::to_image(const BoundingBox& box) const {
  const float x_scale = static_cast<float>(image_width_) / static_cast<float>(resized_width_);
  const float y_scale = static_cast<float>(image_height_) / static_cast<float>(resized_height_);
  const auto x = [&](float value) {
    return std::clamp((value - static_cast<float>(left_)) * x_scale, 0.0F, static_cast<float>(image_width_)) - 0.5F;
  };
  const auto y = [&](float value) {
    return std::clamp((value - static_cast<float>(top_)) * y_scale, 0.0F, static_cast<float>(image_height_)) - 0.5F;
  };
  return {x(box.x_min), y(box.y_min), x(box.x_max), y(box.y_max)};
}

}  // namespace posed
