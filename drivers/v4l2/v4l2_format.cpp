#include "drivers/v4l2/v4l2_format.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr std::array<V4l2PixelFormat, 6> kColorFormats{{{"yuyv", V4L2_PIX_FMT_YUYV, 2},
                                                        {"nv12", V4L2_PIX_FMT_NV12, 1},
                                                        {"mjpeg", V4L2_PIX_FMT_MJPEG, 0},
                                                        {"rgb24", V4L2_PIX_FMT_RGB24, 3},
                                                        {"bgr24", V4L2_PIX_FMT_BGR24, 3},
                                                        {"grey", V4L2_PIX_FMT_GREY, 1}}};
constexpr std::array<V4l2PixelFormat, 2> kDepthFormats{{{"z16", V4L2_PIX_FMT_Z16, 2}, {"y16", V4L2_PIX_FMT_Y16, 2}}};

constexpr std::uint32_t kMaxSide = 16384;  // pixels; keeps every product of sizes far from overflow

tl::unexpected<Error> unsupported(std::string message) {
  return make_error(ErrorCode::Unsupported, std::move(message));
}

YuvCoding coding_of(const v4l2_pix_format& answer) {
  const std::uint32_t encoding = answer.ycbcr_enc == V4L2_YCBCR_ENC_DEFAULT
                                     ? static_cast<std::uint32_t>(V4L2_MAP_YCBCR_ENC_DEFAULT(answer.colorspace))
                                     : answer.ycbcr_enc;
  const std::uint32_t range = answer.quantization == V4L2_QUANTIZATION_DEFAULT
                                  ? static_cast<std::uint32_t>(V4L2_MAP_QUANTIZATION_DEFAULT(false, answer.colorspace, encoding))
                                  : answer.quantization;
  return {encoding == V4L2_YCBCR_ENC_709 || encoding == V4L2_YCBCR_ENC_XV709 ? YuvMatrix::Bt709 : YuvMatrix::Bt601,
          range == V4L2_QUANTIZATION_FULL_RANGE ? YuvRange::Full : YuvRange::Limited};
}

Status check_shape(const V4l2PixelFormat& format, const v4l2_pix_format& answer) {
  if (answer.width == 0 || answer.height == 0 || answer.width > kMaxSide || answer.height > kMaxSide) {
    return unsupported(fmt::format("the driver tells of images of {}x{} pixels", answer.width, answer.height));
  }
  if (answer.field != V4L2_FIELD_NONE && answer.field != V4L2_FIELD_ANY) {
    return unsupported(fmt::format("the images are interlaced (V4L2 field order {})", answer.field));
  }
  const bool pairs_columns = format.fourcc == V4L2_PIX_FMT_YUYV || format.fourcc == V4L2_PIX_FMT_NV12;
  const bool pairs_rows = format.fourcc == V4L2_PIX_FMT_NV12;
  if ((pairs_columns && answer.width % 2 != 0) || (pairs_rows && answer.height % 2 != 0)) {
    return unsupported(
        fmt::format("{} of {}x{} pixels: its colours belong to pairs of pixels", format.name, answer.width, answer.height));
  }
  return {};
}

}  // namespace

std::span<const V4l2PixelFormat> v4l2_color_formats() {
  return kColorFormats;
}

std::span<const V4l2PixelFormat> v4l2_depth_formats() {
  return kDepthFormats;
}

const V4l2PixelFormat* find_v4l2_format(std::uint32_t fourcc) {
  for (const std::span<const V4l2PixelFormat> formats : {v4l2_color_formats(), v4l2_depth_formats()}) {
    const auto found = std::find_if(formats.begin(), formats.end(), [&](const auto& format) { return format.fourcc == fourcc; });
    if (found != formats.end()) {
      return &*found;
    }
  }
  return nullptr;
}

std::string fourcc_text(std::uint32_t fourcc) {
  constexpr std::uint32_t kBigEndian = std::uint32_t{1} << 31;
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const char letter = static_cast<char>(((fourcc & ~kBigEndian) >> shift) & 0xffU);
    text += letter >= ' ' && letter <= '~' ? letter : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return (fourcc & kBigEndian) != 0 ? text + "-BE" : text;
}

Result<V4l2Layout> layout_of(const v4l2_pix_format& answer) {
  const V4l2PixelFormat* format = find_v4l2_format(answer.pixelformat);
  if (format == nullptr) {
    return unsupported(fmt::format("the driver gives {}, which is not one of ours", fourcc_text(answer.pixelformat)));
  }
  if (Status shape = check_shape(*format, answer); !shape) {
    return tl::unexpected(std::move(shape).error());
  }
  V4l2Layout layout{.format = format,
                    .width = static_cast<int>(answer.width),
                    .height = static_cast<int>(answer.height),
                    .buffer_bytes = answer.sizeimage,
                    .coding = coding_of(answer)};
  if (format->bytes_per_pixel == 0) {
    return layout;
  }
  const std::size_t least = static_cast<std::size_t>(answer.width) * static_cast<std::size_t>(format->bytes_per_pixel);
  layout.bytes_per_line = answer.bytesperline == 0 ? least : answer.bytesperline;
  if (layout.bytes_per_line < least || layout.bytes_per_line > 4 * least + 4096) {
    return unsupported(fmt::format("the driver tells of rows of {} bytes where {} pixels of {} take {}", answer.bytesperline,
                                   answer.width, format->name, least));
  }
  const bool sixteen_bits = format->fourcc == V4L2_PIX_FMT_Z16 || format->fourcc == V4L2_PIX_FMT_Y16;
  if (sixteen_bits && layout.bytes_per_line % 2 != 0) {
    return unsupported(fmt::format("the driver tells of rows of {} bytes, which split a pixel of 16 bits", layout.bytes_per_line));
  }
  // The last row need not be padded.
  const std::size_t rows = format->fourcc == V4L2_PIX_FMT_NV12 ? answer.height + answer.height / 2 : answer.height;
  layout.image_bytes = layout.bytes_per_line * (rows - 1) + least;
  if (layout.buffer_bytes < layout.image_bytes) {
    return unsupported(fmt::format("the driver tells of images of {} bytes where {}x{} of {} takes {}", answer.sizeimage,
                                   answer.width, answer.height, format->name, layout.image_bytes));
  }
  return layout;
}

}  // namespace posed
