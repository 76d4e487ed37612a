#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.h"
#include "core/rgbd_frame.h"
#include "drivers/mjpeg_decoder.h"
#include "drivers/yuv_conversion.h"

namespace posed {

/// Order of the bytes in memory; libcamera names the first two the other way round, by their place in a little-endian word.
enum class ColorLayout : std::uint8_t { Bgr, Rgb, Yuyv, Nv12, Mjpeg };

struct ColorFormat {
  ColorLayout layout = ColorLayout::Bgr;
  int width = 0;
  int height = 0;
  std::size_t stride_bytes = 0;  ///< of the first plane, and of NV12's second; 0 for MJPEG
  YuvCoding coding;
};

/// Where an image lies.
struct ColorPlanes {
  std::span<const std::uint8_t> first;
  std::span<const std::uint8_t> second;  ///< the chroma of NV12
};

/// The least that the planes of a format must hold; 0 for MJPEG, whose images take what they need, and for a plane that is not.
/// Reentrant.
std::size_t least_first_bytes(const ColorFormat& format);
std::size_t least_second_bytes(const ColorFormat& format);

/// The colour and the grey image of the frame, whose size is the format's. `bytes_used` is the length of an MJPEG image. BadData
/// where that is damaged. Reentrant.
Status write_color(const ColorFormat& format, const ColorPlanes& planes, std::size_t bytes_used, MjpegDecoder& mjpeg,
                   RgbdFrame& frame);

}  // namespace posed
