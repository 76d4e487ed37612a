#include "drivers/v4l2/v4l2_negotiation.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr std::uint32_t kMostFormats = 256;  // of a driver that never ends its list

std::vector<std::uint32_t> offered_formats(const V4l2Device& device) {
  std::vector<std::uint32_t> offered;
  for (std::uint32_t i = 0; i < kMostFormats; ++i) {
    v4l2_fmtdesc description{};
    description.index = i;
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.ioctl(VIDIOC_ENUM_FMT, &description) < 0) {
      break;
    }
    offered.push_back(description.pixelformat);
  }
  return offered;
}

std::string text_of(const std::vector<std::uint32_t>& fourccs) {
  std::string text;
  for (const std::uint32_t fourcc : fourccs) {
    text += (text.empty() ? "" : ", ") + fourcc_text(fourcc);
  }
  return text.empty() ? "nothing that it tells of" : text;
}

/// The sizes that a node has in a format: " (it has 640x480, 320x240)", or nothing where it does not tell.
std::string offered_sizes(const V4l2Device& device, std::uint32_t fourcc) {
  constexpr std::uint32_t kMostSizes = 64;
  std::string sizes;
  for (std::uint32_t i = 0; i < kMostSizes; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (device.ioctl(VIDIOC_ENUM_FRAMESIZES, &size) < 0) {
      break;
    }
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      const v4l2_frmsize_stepwise& s = size.stepwise;
      sizes = fmt::format("{}x{} to {}x{} in steps of {}x{}", s.min_width, s.min_height, s.max_width, s.max_height, s.step_width,
                          s.step_height);
      break;
    }
    sizes += fmt::format("{}{}x{}", sizes.empty() ? "" : ", ", size.discrete.width, size.discrete.height);
  }
  return sizes.empty() ? "" : fmt::format(" (it has {})", sizes);
}

Result<V4l2Layout> set_format(const V4l2Device& device, const V4l2PixelFormat& wanted, int width, int height) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(width);
  format.fmt.pix.height = static_cast<std::uint32_t>(height);
  format.fmt.pix.pixelformat = wanted.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int done = device.ioctl(VIDIOC_S_FMT, &format); done < 0) {
    return device.failure(fmt::format("S_FMT to {}, {}x{}", wanted.name, width, height), done);
  }
  const v4l2_pix_format& got = format.fmt.pix;
  if (got.pixelformat != wanted.fourcc) {
    return device.unsupported(fmt::format("asked for {} ({}), the driver gives {}", wanted.name, fourcc_text(wanted.fourcc),
                                          fourcc_text(got.pixelformat)));
  }
  if (got.width != static_cast<std::uint32_t>(width) || got.height != static_cast<std::uint32_t>(height)) {
    return device.unsupported(fmt::format("asked for {} of {}x{} pixels, the size in the calibration, the driver gives {}x{}{}",
                                          wanted.name, width, height, got.width, got.height, offered_sizes(device, wanted.fourcc)));
  }
  Result<V4l2Layout> layout = layout_of(got);
  if (!layout) {
    return device.unsupported(layout.error().message);
  }
  return layout;
}

}  // namespace

Status check_capture_node(const V4l2Device& device) {
  const Result<v4l2_capability> capability = device.capability();
  if (!capability) {
    return tl::unexpected(capability.error());
  }
  const std::uint32_t capabilities = capabilities_of(*capability);
  if ((capabilities & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return device.unsupported((capabilities & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                                  ? "delivers images in several planes only; try source.kind = \"libcamera\""
                                  : "delivers no images (metadata or output; a camera often has several nodes)");
  }
  if ((capabilities & V4L2_CAP_STREAMING) == 0) {
    return device.unsupported("cannot stream into mapped buffers");
  }
  return {};
}

Result<V4l2Layout> negotiate_format(const V4l2Device& device, const V4l2Request& request) {
  const std::vector<std::uint32_t> offered = offered_formats(device);
  const auto is_offered = [&](std::uint32_t fourcc) {
    return offered.empty() || std::find(offered.begin(), offered.end(), fourcc) != offered.end();
  };
  tl::unexpected<Error> refused =
      device.unsupported(fmt::format("does not offer the format {}; it offers {}",
                                     request.format == "auto" ? "that is needed" : request.format, text_of(offered)));
  for (const V4l2PixelFormat& format : request.formats) {
    const bool asked = request.format == "auto" || request.format == format.name;
    if (!asked || !is_offered(format.fourcc)) {
      continue;
    }
    Result<V4l2Layout> layout = set_format(device, format, request.width, request.height);
    if (layout || layout.error().code != ErrorCode::Unsupported) {
      return layout;
    }
    refused = tl::unexpected(std::move(layout).error());
  }
  return refused;
}

TimeNs negotiate_period(const V4l2Device& device, double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  constexpr std::uint32_t kPrecision = 1000;
  parameters.parm.capture.timeperframe = {kPrecision, static_cast<std::uint32_t>(std::lround(rate_hz * kPrecision))};
  if (device.ioctl(VIDIOC_S_PARM, &parameters) >= 0) {
    const v4l2_fract& period = parameters.parm.capture.timeperframe;
    if (period.numerator > 0 && period.denominator > 0) {
      return from_seconds(static_cast<double>(period.numerator) / period.denominator);
    }
  }
  return from_seconds(1.0 / rate_hz);
}

}  // namespace posed
