#include "tools/posectl/color_image.h"

#include <cstddef>

namespace posed {

Status ColorImage::read(const std::filesystem::path& path) {
  const Result<ImageHeader> header = decoder_.read_header(path);
  if (!header) {
    return tl::unexpected<Error>(header.error());
  }
  width_ = header->width;
  height_ = header->height;
  const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  bgr_.resize(3 * pixels);
  gray_.resize(pixels);
  return decoder_.read_color(path, bgr(), {gray_.data(), width_, height_, width_, 1});
}

}  // namespace posed
