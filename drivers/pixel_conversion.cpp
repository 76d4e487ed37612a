#include "drivers/pixel_conversion.h"

#include <cassert>
#include <cmath>

namespace posed {

namespace {

constexpr int kRed = 4899;
constexpr int kGreen = 9617;
constexpr int kBlue = 1868;
constexpr int kShift = 14;
constexpr int kHalf = 1 << (kShift - 1);
static_assert(kRed + kGreen + kBlue == 1 << kShift, "white must stay white");

constexpr double kMaxRaw = 65535.0;

}  // namespace

void gray_from_bgr(ImageView<const std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  assert(bgr.width == gray.width && bgr.height == gray.height && bgr.channels == 3 && gray.channels == 1);
  for (int y = 0; y < bgr.height; ++y) {
    const std::uint8_t* __restrict from = bgr.row(y);
    std::uint8_t* __restrict to = gray.row(y);
    for (int x = 0; x < bgr.width; ++x) {
      const int luma = from[3 * x] * kBlue + from[3 * x + 1] * kGreen + from[3 * x + 2] * kRed;
      to[x] = static_cast<std::uint8_t>((luma + kHalf) >> kShift);
    }
  }
}

void swap_red_blue(ImageView<const std::uint8_t> from, ImageView<std::uint8_t> to) {
  assert(from.width == to.width && from.height == to.height && from.channels == 3 && to.channels == 3);
  for (int y = 0; y < from.height; ++y) {
    const std::uint8_t* __restrict source = from.row(y);
    std::uint8_t* __restrict target = to.row(y);
    for (int x = 0; x < 3 * from.width; x += 3) {
      target[x] = source[x + 2];
      target[x + 1] = source[x + 1];
      target[x + 2] = source[x];
    }
  }
}

void bgr_from_gray(ImageView<const std::uint8_t> gray, ImageView<std::uint8_t> bgr) {
  assert(gray.width == bgr.width && gray.height == bgr.height && gray.channels == 1 && bgr.channels == 3);
  for (int y = 0; y < gray.height; ++y) {
    const std::uint8_t* __restrict from = gray.row(y);
    std::uint8_t* __restrict to = bgr.row(y);
    for (int x = 0; x < gray.width; ++x) {
      to[3 * x] = to[3 * x + 1] = to[3 * x + 2] = from[x];
    }
  }
}

void depth_from_raw(ImageView<const std::uint16_t> raw, double units_per_metre, ImageView<float> depth_m) {
  assert(raw.width == depth_m.width && raw.height == depth_m.height && raw.channels == 1 && depth_m.channels == 1);
  const auto units = static_cast<float>(units_per_metre);
  for (int y = 0; y < raw.height; ++y) {
    const std::uint16_t* __restrict from = raw.row(y);
    float* __restrict to = depth_m.row(y);
    for (int x = 0; x < raw.width; ++x) {
      to[x] = static_cast<float>(from[x]) / units;
    }
  }
}

void raw_from_depth(ImageView<const float> depth_m, double units_per_metre, ImageView<std::uint16_t> raw) {
  assert(raw.width == depth_m.width && raw.height == depth_m.height && raw.channels == 1 && depth_m.channels == 1);
  for (int y = 0; y < raw.height; ++y) {
    const float* __restrict from = depth_m.row(y);
    std::uint16_t* __restrict to = raw.row(y);
    for (int x = 0; x < raw.width; ++x) {
      const double units = std::floor(static_cast<double>(from[x]) * units_per_metre + 0.5);
      to[x] = units >= 0.0 && units <= kMaxRaw ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
    }
  }
}

}  // namespace posed
