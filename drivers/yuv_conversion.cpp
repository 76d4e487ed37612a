#include "drivers/yuv_conversion.h"

#include <algorithm>
#include <cassert>

namespace posed {

namespace {

constexpr int kShift = 14;
constexpr int kHalf = 1 << (kShift - 1);

/// blue = luma * (Y - black) + blue_u * U and so on, with U and V less 128, in units of 1 / 2^14.
struct Coefficients {
  int black = 0;
  int luma = 0;
  int red_v = 0;
  int green_u = 0;
  int green_v = 0;
  int blue_u = 0;
};

constexpr int fixed(double value) {
  return static_cast<int>(value * (1 << kShift) + (value < 0 ? -0.5 : 0.5));
}

/// From the weights of red and blue in the luma (ITU-R BT.601 and BT.709, section 3).
constexpr Coefficients derive(double red, double blue, YuvRange range) {
  const bool full = range == YuvRange::Full;
  const double luma = full ? 1.0 : 255.0 / 219.0;
  const double chroma = full ? 1.0 : 255.0 / 224.0;
  const double green = 1.0 - red - blue;
  return {full ? 0 : 16,
          fixed(luma),
          fixed(2.0 * (1.0 - red) * chroma),
          fixed(-2.0 * (1.0 - blue) * blue / green * chroma),
          fixed(-2.0 * (1.0 - red) * red / green * chroma),
          fixed(2.0 * (1.0 - blue) * chroma)};
}

constexpr Coefficients kBt601Limited = derive(0.299, 0.114, YuvRange::Limited);
constexpr Coefficients kBt601Full = derive(0.299, 0.114, YuvRange::Full);
constexpr Coefficients kBt709Limited = derive(0.2126, 0.0722, YuvRange::Limited);
constexpr Coefficients kBt709Full = derive(0.2126, 0.0722, YuvRange::Full);

const Coefficients& coefficients_of(YuvCoding coding) {
  if (coding.matrix == YuvMatrix::Bt709) {
    return coding.range == YuvRange::Full ? kBt709Full : kBt709Limited;
  }
  return coding.range == YuvRange::Full ? kBt601Full : kBt601Limited;
}

std::uint8_t to_byte(int fixed_value) {
  return static_cast<std::uint8_t>(std::clamp((fixed_value + kHalf) >> kShift, 0, 255));
}

/// Two pixels that share their chroma.
struct Chroma {
  int red, green, blue;
};

Chroma chroma_of(const Coefficients& c, int u, int v) {
  return {c.red_v * (v - 128), c.green_u * (u - 128) + c.green_v * (v - 128), c.blue_u * (u - 128)};
}

void write_pixel(const Coefficients& c, int y, const Chroma& chroma, std::uint8_t* bgr, std::uint8_t* gray) {
  const int luma = c.luma * (y - c.black);
  bgr[0] = to_byte(luma + chroma.blue);
  bgr[1] = to_byte(luma + chroma.green);
  bgr[2] = to_byte(luma + chroma.red);
  *gray = to_byte(luma);
}

[[maybe_unused]] bool same_size(ImageView<const std::uint8_t> a, ImageView<const std::uint8_t> b) {
  return a.width == b.width && a.height == b.height;
}

}  // namespace

void bgr_and_gray_from_yuyv(ImageView<const std::uint8_t> yuyv, YuvCoding coding, ImageView<std::uint8_t> bgr,
                            ImageView<std::uint8_t> gray) {
  assert(same_size(yuyv, bgr) && same_size(yuyv, gray) && yuyv.channels == 2 && yuyv.width % 2 == 0);
  const Coefficients c = coefficients_of(coding);
  for (int y = 0; y < yuyv.height; ++y) {
    const std::uint8_t* __restrict from = yuyv.row(y);
    std::uint8_t* __restrict color = bgr.row(y);
    std::uint8_t* __restrict grey = gray.row(y);
    for (int x = 0; x < yuyv.width; x += 2, from += 4) {
      const Chroma chroma = chroma_of(c, from[1], from[3]);
      write_pixel(c, from[0], chroma, color + 3 * x, grey + x);
      write_pixel(c, from[2], chroma, color + 3 * x + 3, grey + x + 1);
    }
  }
}

void bgr_and_gray_from_nv12(ImageView<const std::uint8_t> luma, ImageView<const std::uint8_t> chroma, YuvCoding coding,
                            ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  assert(same_size(luma, bgr) && same_size(luma, gray) && luma.width % 2 == 0 && luma.height % 2 == 0);
  assert(chroma.width == luma.width && 2 * chroma.height == luma.height);
  const Coefficients c = coefficients_of(coding);
  for (int y = 0; y < luma.height; ++y) {
    const std::uint8_t* __restrict from = luma.row(y);
    const std::uint8_t* __restrict uv = chroma.row(y / 2);
    std::uint8_t* __restrict color = bgr.row(y);
    std::uint8_t* __restrict grey = gray.row(y);
    for (int x = 0; x < luma.width; x += 2) {
      const Chroma both = chroma_of(c, uv[x], uv[x + 1]);
      write_pixel(c, from[x], both, color + 3 * x, grey + x);
      write_pixel(c, from[x + 1], both, color + 3 * x + 3, grey + x + 1);
    }
  }
}

}  // namespace posed
