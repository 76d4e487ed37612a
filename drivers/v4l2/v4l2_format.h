#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <linux/videodev2.h>

#include "core/result.h"
#include "drivers/yuv_conversion.h"

/// Pixel formats of V4L2 by the configuration's words, and how an image lies in a buffer. Reentrant.
namespace posed {

/// One format that the drivers read.
struct V4l2PixelFormat {
  std::string_view name;  ///< the configuration's word
  std::uint32_t fourcc = 0;
  int bytes_per_pixel = 0;  ///< of the first plane; 0 for compressed images
};

std::span<const V4l2PixelFormat> v4l2_color_formats();  ///< in the order that "auto" tries them
std::span<const V4l2PixelFormat> v4l2_depth_formats();

/// The format with this code; null where we do not read it.
const V4l2PixelFormat* find_v4l2_format(std::uint32_t fourcc);

/// The four letters of a code: "YUYV".
std::string fourcc_text(std::uint32_t fourcc);

/// How an image lies in a buffer, as the driver told and we checked.
struct V4l2Layout {
  const V4l2PixelFormat* format = nullptr;
  int width = 0;   ///< pixels
  int height = 0;  ///< rows
  std::size_t bytes_per_line = 0;
  std::size_t image_bytes = 0;   ///< what a whole image takes; 0 for compressed ones, which take what they need
  std::size_t buffer_bytes = 0;  ///< what a buffer must hold
  YuvCoding coding;              ///< of YUV formats
};

/// The layout that the driver's answer to VIDIOC_S_FMT means. Unsupported: interlaced images, rows or images too short to be true,
/// sizes that the format cannot have. Does not look whether the size is the one asked for.
Result<V4l2Layout> layout_of(const v4l2_pix_format& answer);

}  // namespace posed
