#include "tools/posectl/model_images.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace posed {
namespace {

constexpr float kBorder = 114.0F / 255.0F;  // what YOLOv5 is trained with
constexpr int kColorChannels = 3;

/// One pixel's channel between its four neighbours; beyond the edges the image is continued.
float bilinear(const ImageView<const std::uint8_t>& image, float x, float y, int channel) {
  const float inside_x = std::clamp(x, 0.0F, static_cast<float>(image.width - 1));
  const float inside_y = std::clamp(y, 0.0F, static_cast<float>(image.height - 1));
  const int left = static_cast<int>(inside_x);
  const int top = static_cast<int>(inside_y);
  const int right = std::min(left + 1, image.width - 1);
  const int bottom = std::min(top + 1, image.height - 1);
  const float weight_x = inside_x - static_cast<float>(left);
  const float weight_y = inside_y - static_cast<float>(top);
  const auto value = [&](int column, int row) { return static_cast<float>((&image.at(column, row))[channel]); };
  const float above = value(left, top) + weight_x * (value(right, top) - value(left, top));
  const float below = value(left, bottom) + weight_x * (value(right, bottom) - value(left, bottom));
  return above + weight_y * (below - above);
}

}  // namespace

void letterbox(const ImageView<const std::uint8_t>& bgr, const TensorShape& input, std::span<float> planes) {
  const float scale = std::min(static_cast<float>(input.width) / static_cast<float>(bgr.width),
                               static_cast<float>(input.height) / static_cast<float>(bgr.height));
  const int width = static_cast<int>(std::lround(static_cast<float>(bgr.width) * scale));
  const int height = static_cast<int>(std::lround(static_cast<float>(bgr.height) * scale));
  const int left = (input.width - width) / 2;
  const int top = (input.height - height) / 2;
  std::fill(planes.begin(), planes.end(), kBorder);
  for (int channel = 0; channel < kColorChannels; ++channel) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float from_x = (static_cast<float>(x) + 0.5F) / scale - 0.5F;
        const float from_y = (static_cast<float>(y) + 0.5F) / scale - 0.5F;
        const int to = ((kColorChannels - 1 - channel) * input.height + top + y) * input.width + left + x;
        planes[static_cast<std::size_t>(to)] = bilinear(bgr, from_x, from_y, channel) / 255.0F;
      }
    }
  }
}

Status ModelImages::fill(std::size_t index, std::span<float> input) {
  if (input_.channels != kColorChannels) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the network takes {} channels, an image has 3", input_.channels));
  }
  const Result<ImageHeader> header = decoder_.read_header(paths_[index]);
  if (!header) {
    return tl::unexpected<Error>(header.error());
  }
  const auto pixels = static_cast<std::size_t>(header->width) * static_cast<std::size_t>(header->height);
  bgr_.resize(kColorChannels * pixels);
  gray_.resize(pixels);
  const ImageView<std::uint8_t> bgr{bgr_.data(), header->width, header->height, std::ptrdiff_t{kColorChannels} * header->width,
                                    kColorChannels};
  const ImageView<std::uint8_t> gray{gray_.data(), header->width, header->height, header->width, 1};
  if (const Status decoded = decoder_.read_color(paths_[index], bgr, gray); !decoded) {
    return decoded;
  }
  letterbox(bgr, input_, input);
  return {};
}

}  // namespace posed
