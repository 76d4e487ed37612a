#include "drivers/v4l2/color_node.h"

#include <cstring>

#include <fmt/format.h>

#include "drivers/pixel_conversion.h"
#include "drivers/yuv_conversion.h"

namespace posed {

namespace {

void copy_rows(ImageView<const std::uint8_t> from, ImageView<std::uint8_t> to) {
  const auto bytes = static_cast<std::size_t>(from.width) * static_cast<std::size_t>(from.channels);
  for (int y = 0; y < from.height; ++y) {
    std::memcpy(to.row(y), from.row(y), bytes);
  }
}

}  // namespace

ColorNode::ColorNode(V4l2System& system, const Clock& clock, const V4l2Config& config, const CameraIntrinsics& color,
                     double rate_hz)
    : stream_(system, clock, config,
              {.formats = v4l2_color_formats(), .width = color.width, .height = color.height, .rate_hz = rate_hz}) {}

Status ColorNode::write_color(const V4l2Image& image, RgbdFrame& frame) {
  const V4l2Layout& layout = stream_.layout();
  const auto stride = static_cast<std::ptrdiff_t>(layout.bytes_per_line);
  const auto view = [&](int channels) {
    return ImageView<const std::uint8_t>{image.bytes.data(), layout.width, layout.height, stride, channels};
  };
  switch (layout.format->fourcc) {
    case V4L2_PIX_FMT_YUYV: bgr_and_gray_from_yuyv(view(2), layout.coding, frame.bgr, frame.gray); return {};
    case V4L2_PIX_FMT_NV12: {
      const ImageView<const std::uint8_t> chroma{image.bytes.data() + stride * layout.height, layout.width, layout.height / 2,
                                                 stride, 1};
      bgr_and_gray_from_nv12(view(1), chroma, layout.coding, frame.bgr, frame.gray);
      return {};
    }
    case V4L2_PIX_FMT_RGB24:
      swap_red_blue(view(3), frame.bgr);
      gray_from_bgr(frame.bgr, frame.gray);
      return {};
    case V4L2_PIX_FMT_BGR24:
      copy_rows(view(3), frame.bgr);
      gray_from_bgr(frame.bgr, frame.gray);
      return {};
    case V4L2_PIX_FMT_GREY:
      copy_rows(view(1), frame.gray);
      bgr_from_gray(frame.gray, frame.bgr);
      return {};
    default: break;
  }
  Status decoded = mjpeg_.decode(image.bytes, frame.bgr, frame.gray);  // the only one left that negotiation lets through
  if (!decoded) {
    decoded.error().message = fmt::format("{}: image {}: {}", stream_.path(), image.sequence, decoded.error().message);
  }
  return decoded;
}

}  // namespace posed
