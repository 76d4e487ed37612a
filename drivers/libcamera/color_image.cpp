#include "drivers/libcamera/color_image.h"

#include <algorithm>
#include <cstring>

#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

int bytes_per_pixel(ColorLayout layout) {
  switch (layout) {
    case ColorLayout::Bgr:
    case ColorLayout::Rgb: return 3;
    case ColorLayout::Yuyv: return 2;
    case ColorLayout::Nv12: return 1;
    case ColorLayout::Mjpeg: return 0;
  }
  return 0;
}

/// The last row may end without its padding.
std::size_t rows_bytes(const ColorFormat& format, int rows) {
  const auto row_bytes = static_cast<std::size_t>(format.width * bytes_per_pixel(format.layout));
  return static_cast<std::size_t>(rows - 1) * format.stride_bytes + row_bytes;
}

}  // namespace

std::size_t least_first_bytes(const ColorFormat& format) {
  return format.layout == ColorLayout::Mjpeg ? 0 : rows_bytes(format, format.height);
}

std::size_t least_second_bytes(const ColorFormat& format) {
  return format.layout == ColorLayout::Nv12 ? rows_bytes(format, format.height / 2) : 0;
}

Status write_color(const ColorFormat& format, const ColorPlanes& planes, std::size_t bytes_used, MjpegDecoder& mjpeg,
                   RgbdFrame& frame) {
  const ImageView<const std::uint8_t> first{planes.first.data(), format.width, format.height,
                                            static_cast<std::ptrdiff_t>(format.stride_bytes), bytes_per_pixel(format.layout)};
  switch (format.layout) {
    case ColorLayout::Bgr:
      for (int y = 0; y < format.height; ++y) {
        std::memcpy(frame.bgr.row(y), first.row(y), static_cast<std::size_t>(3 * format.width));
      }
      gray_from_bgr(frame.bgr, frame.gray);
      return {};
    case ColorLayout::Rgb:
      swap_red_blue(first, frame.bgr);
      gray_from_bgr(frame.bgr, frame.gray);
      return {};
    case ColorLayout::Yuyv: bgr_and_gray_from_yuyv(first, format.coding, frame.bgr, frame.gray); return {};
    case ColorLayout::Nv12: {
      const ImageView<const std::uint8_t> chroma{planes.second.data(), format.width, format.height / 2,
                                                 static_cast<std::ptrdiff_t>(format.stride_bytes), 1};
      bgr_and_gray_from_nv12(first, chroma, format.coding, frame.bgr, frame.gray);
      return {};
    }
    case ColorLayout::Mjpeg: break;
  }
  return mjpeg.decode(planes.first.first(std::min(bytes_used, planes.first.size())), frame.bgr, frame.gray);
}

}  // namespace posed
