#include "drivers/openni2/openni2_modes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>

#include <fmt/format.h>

namespace posed {

namespace {

// Best first.
constexpr std::array kColorFormats = {openni::PIXEL_FORMAT_RGB888, openni::PIXEL_FORMAT_YUYV, openni::PIXEL_FORMAT_YUV422,
                                      openni::PIXEL_FORMAT_GRAY8};
constexpr std::array kDepthFormats = {openni::PIXEL_FORMAT_DEPTH_1_MM, openni::PIXEL_FORMAT_DEPTH_100_UM};

bool contains(std::span<const openni::PixelFormat> formats, openni::PixelFormat format) {
  return std::find(formats.begin(), formats.end(), format) != formats.end();
}

std::vector<openni::VideoMode> usable_modes(const openni::Array<openni::VideoMode>& offered, const OpenNi2Wish& wish,
                                            std::span<const openni::PixelFormat> formats) {
  std::vector<openni::VideoMode> usable;
  for (int i = 0; i < offered.getSize(); ++i) {
    const openni::VideoMode& mode = offered[i];
    if (mode.getResolutionX() == wish.width && mode.getResolutionY() == wish.height && contains(formats, mode.getPixelFormat())) {
      usable.push_back(mode);
    }
  }
  const auto rank = [&](const openni::VideoMode& mode) {
    const openni::PixelFormat format = mode.getPixelFormat();
    return std::tuple(format == openni::PIXEL_FORMAT_GRAY8, std::abs(mode.getFps() - wish.rate_hz),
                      std::find(formats.begin(), formats.end(), format) - formats.begin());
  };
  std::stable_sort(usable.begin(), usable.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return usable;
}

}  // namespace

std::string openni2_format_name(openni::PixelFormat format) {
  switch (format) {
    case openni::PIXEL_FORMAT_DEPTH_1_MM: return "depth_1_mm";
    case openni::PIXEL_FORMAT_DEPTH_100_UM: return "depth_100_um";
    case openni::PIXEL_FORMAT_SHIFT_9_2: return "shift_9_2";
    case openni::PIXEL_FORMAT_SHIFT_9_3: return "shift_9_3";
    case openni::PIXEL_FORMAT_RGB888: return "rgb888";
    case openni::PIXEL_FORMAT_YUV422: return "yuv422";
    case openni::PIXEL_FORMAT_GRAY8: return "gray8";
    case openni::PIXEL_FORMAT_GRAY16: return "gray16";
    case openni::PIXEL_FORMAT_JPEG: return "jpeg";
    case openni::PIXEL_FORMAT_YUYV: return "yuyv";
  }
  return fmt::format("format {}", static_cast<int>(format));
}

std::string openni2_mode_name(const openni::VideoMode& mode) {
  return fmt::format("{}x{} {} at {} Hz", mode.getResolutionX(), mode.getResolutionY(), openni2_format_name(mode.getPixelFormat()),
                     mode.getFps());
}

std::vector<openni::VideoMode> usable_color_modes(const openni::Array<openni::VideoMode>& offered, const OpenNi2Wish& wish) {
  return usable_modes(offered, wish, kColorFormats);
}

std::vector<openni::VideoMode> usable_depth_modes(const openni::Array<openni::VideoMode>& offered, const OpenNi2Wish& wish) {
  return usable_modes(offered, wish, kDepthFormats);
}

bool is_usable_color(openni::PixelFormat format) {
  return contains(kColorFormats, format);
}

bool is_usable_depth(openni::PixelFormat format) {
  return contains(kDepthFormats, format);
}

}  // namespace posed
