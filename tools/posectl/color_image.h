#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/image_view.h"
#include "core/result.h"
#include "drivers/image_file.h"

namespace posed {

/// Reads colour images of any size; the pixels are here until the next one is read. Thread-bound.
class ColorImage {
 public:
  /// Errors: as ImageDecoder.
  Status read(const std::filesystem::path& path);

  /// 8-bit blue, green and red; may be drawn on.
  ImageView<std::uint8_t> bgr() { return {bgr_.data(), width_, height_, std::ptrdiff_t{3} * width_, 3}; }

 private:
  ImageDecoder decoder_;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> bgr_;
  std::vector<std::uint8_t> gray_;
};

}  // namespace posed
