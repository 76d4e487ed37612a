#include "drivers/openni2/openni2_pixels.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

constexpr double kMillimetresPerMetre = 1000.0;
constexpr double kUnitsOf100UmPerMetre = 10'000.0;

int bytes_a_pixel(openni::PixelFormat format) {
  switch (format) {
    case openni::PIXEL_FORMAT_RGB888: return 3;
    case openni::PIXEL_FORMAT_GRAY8: return 1;
    default: return 2;  // depth, YUYV and YUV422
  }
}

template <typename T>
ImageView<const T> view_of(const openni::VideoFrameRef& image, int channels) {
  return {static_cast<const T*>(image.getData()), image.getWidth(), image.getHeight(),
          image.getStrideInBytes() / static_cast<std::ptrdiff_t>(sizeof(T)), channels};
}

// ITU-R BT.601 with the studio's range, which is what these cameras deliver, in 16-bit fixed point.
constexpr int kShift = 16;
constexpr int kHalf = 1 << (kShift - 1);
constexpr int kLuma = 76309;       // 255 / 219
constexpr int kRedOfV = 104597;    // 1.402 * 255 / 224
constexpr int kGreenOfU = -25675;  // -0.344136 * 255 / 224
constexpr int kGreenOfV = -53279;  // -0.714136 * 255 / 224
constexpr int kBlueOfU = 132201;   // 1.772 * 255 / 224
constexpr int kBlack = 16;
constexpr int kNoChroma = 128;

std::uint8_t to_byte(int fixed) {
  return static_cast<std::uint8_t>(std::clamp((fixed + kHalf) >> kShift, 0, 255));
}

/// Where each value stands in the four bytes of two pixels.
struct PairLayout {
  int y0, y1, u, v;
};
constexpr PairLayout kYuyv{0, 2, 1, 3};
constexpr PairLayout kUyvy{1, 3, 0, 2};  // OpenNI2's YUV422

void bgr_from_pairs(ImageView<const std::uint8_t> pairs, const PairLayout& layout, ImageView<std::uint8_t> bgr) {
  for (int y = 0; y < bgr.height; ++y) {
    const std::uint8_t* from = pairs.row(y);
    std::uint8_t* to = bgr.row(y);
    for (int x = 0; x + 1 < bgr.width; x += 2, from += 4, to += 6) {
      const int u = from[layout.u] - kNoChroma;
      const int v = from[layout.v] - kNoChroma;
      for (int i = 0; i < 2; ++i) {
        const int luma = kLuma * (from[i == 0 ? layout.y0 : layout.y1] - kBlack);
        to[3 * i] = to_byte(luma + kBlueOfU * u);
        to[3 * i + 1] = to_byte(luma + kGreenOfU * u + kGreenOfV * v);
        to[3 * i + 2] = to_byte(luma + kRedOfV * v);
      }
    }
  }
}

template <typename T>
void mirror(ImageView<T> image) {
  for (int y = 0; y < image.height; ++y) {
    T* left = image.row(y);
    T* right = left + static_cast<std::ptrdiff_t>(image.width - 1) * image.channels;
    for (; left < right; left += image.channels, right -= image.channels) {
      std::swap_ranges(left, left + image.channels, right);
    }
  }
}

}  // namespace

bool is_of_mode(const openni::VideoFrameRef& image, const openni::VideoMode& mode) {
  const int row_bytes = mode.getResolutionX() * bytes_a_pixel(mode.getPixelFormat());
  return image.isValid() && image.getVideoMode().getPixelFormat() == mode.getPixelFormat() &&
         image.getWidth() == mode.getResolutionX() && image.getHeight() == mode.getResolutionY() &&
         image.getStrideInBytes() >= row_bytes &&
         image.getDataSize() >= image.getStrideInBytes() * (image.getHeight() - 1) + row_bytes;
}

void write_color(const openni::VideoFrameRef& image, bool mirrored, RgbdFrame& frame) {
  switch (image.getVideoMode().getPixelFormat()) {
    case openni::PIXEL_FORMAT_RGB888: swap_red_blue(view_of<std::uint8_t>(image, 3), frame.bgr); break;
    case openni::PIXEL_FORMAT_YUYV: bgr_from_pairs(view_of<std::uint8_t>(image, 2), kYuyv, frame.bgr); break;
    case openni::PIXEL_FORMAT_YUV422: bgr_from_pairs(view_of<std::uint8_t>(image, 2), kUyvy, frame.bgr); break;
    default: bgr_from_gray(view_of<std::uint8_t>(image, 1), frame.bgr); break;
  }
  if (mirrored) {
    mirror(frame.bgr);
  }
  gray_from_bgr(frame.bgr, frame.gray);
}

void write_depth(const openni::VideoFrameRef& image, bool mirrored, RgbdFrame& frame) {
  const bool fine = image.getVideoMode().getPixelFormat() == openni::PIXEL_FORMAT_DEPTH_100_UM;
  depth_from_raw(view_of<std::uint16_t>(image, 1), fine ? kUnitsOf100UmPerMetre : kMillimetresPerMetre, frame.depth_m);
  if (mirrored) {
    mirror(frame.depth_m);
  }
}

}  // namespace posed
