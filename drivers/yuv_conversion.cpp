#include "drivers/yuv_conversion.h"

#include <algorithm>
#include <cassert>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <opencv2/core/hal/intrin.hpp>
#pragma GCC diagnostic pop

namespace posed {

namespace {

using cv::v_int16;
using cv::v_int32;
using cv::v_uint16;
using cv::v_uint8;

constexpr int kShift = 13;  // each coefficient fits into 16 bits
constexpr int kHalf = 1 << (kShift - 1);

/// blue = luma * (Y - black) + blue_u * U and so on, with U and V less 128, in units of 1 / 2^13.
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

/// Two numbers of 16 bits in each lane of 32.
v_int16 pairs_of(int first, int second) {
  return cv::v_reinterpret_as_s16(cv::vx_setall_s32((second << 16) | (first & 0xffff)));
}

/// The same for as many pixels as a vector holds, each with its luma and, for each two of them, U and V.
class VectorPixels {
 public:
  static constexpr int kPixels = v_uint8::nlanes;

  explicit VectorPixels(const Coefficients& c)
      : black_(cv::vx_setall_s16(static_cast<short>(c.black))),
        blue_(pairs_of(c.luma, c.blue_u)),
        green_(pairs_of(c.luma, c.green_u)),
        green_v_(pairs_of(c.green_v, kHalf)),
        red_(pairs_of(c.luma, c.red_v)),
        luma_(pairs_of(c.luma, 0)) {}

  void write(const v_uint8& y, const v_uint8& uv, std::uint8_t* bgr, std::uint8_t* gray) const {
    const v_uint16 both = cv::v_reinterpret_as_u16(uv);
    const v_uint16 u = both & cv::vx_setall_u16(0xff);
    const v_uint16 v = both >> 8;
    Half low, high;
    spread(y, low.y, high.y);
    spread(cv::v_reinterpret_as_u8(u | (u << 8)), low.u, high.u);
    spread(cv::v_reinterpret_as_u8(v | (v << 8)), low.v, high.v);
    convert(low);
    convert(high);
    cv::v_store_interleave(bgr, cv::v_pack_u(low.blue, high.blue), cv::v_pack_u(low.green, high.green),
                           cv::v_pack_u(low.red, high.red));
    cv::v_store(gray, cv::v_pack_u(low.luma, high.luma));
  }

 private:
  struct Half {
    v_int16 y, u, v;
    v_int16 blue, green, red, luma;
  };

  static void spread(const v_uint8& bytes, v_int16& low, v_int16& high) {
    v_uint16 first, second;
    cv::v_expand(bytes, first, second);
    low = cv::v_reinterpret_as_s16(first);
    high = cv::v_reinterpret_as_s16(second);
  }

  void convert(Half& half) const {
    const v_int16 middle = cv::vx_setall_s16(128);
    const v_int16 y = half.y - black_;
    const v_int16 u = half.u - middle;
    const v_int16 v = half.v - middle;
    v_int16 yu[2], yv[2], v1[2];
    cv::v_zip(y, u, yu[0], yu[1]);
    cv::v_zip(y, v, yv[0], yv[1]);
    cv::v_zip(v, cv::vx_setall_s16(1), v1[0], v1[1]);
    const v_int32 rounding = cv::vx_setall_s32(kHalf);
    v_int32 blue[2], green[2], red[2], luma[2];
    for (int i = 0; i < 2; ++i) {
      blue[i] = (cv::v_dotprod(yu[i], blue_) + rounding) >> kShift;
      green[i] = (cv::v_dotprod(yu[i], green_) + cv::v_dotprod(v1[i], green_v_)) >> kShift;
      red[i] = (cv::v_dotprod(yv[i], red_) + rounding) >> kShift;
      luma[i] = (cv::v_dotprod(yu[i], luma_) + rounding) >> kShift;
    }
    half.blue = cv::v_pack(blue[0], blue[1]);
    half.green = cv::v_pack(green[0], green[1]);
    half.red = cv::v_pack(red[0], red[1]);
    half.luma = cv::v_pack(luma[0], luma[1]);
  }

  v_int16 black_, blue_, green_, green_v_, red_, luma_;
};

[[maybe_unused]] bool same_size(ImageView<const std::uint8_t> a, ImageView<const std::uint8_t> b) {
  return a.width == b.width && a.height == b.height;
}

}  // namespace

void bgr_and_gray_from_yuyv(ImageView<const std::uint8_t> yuyv, YuvCoding coding, ImageView<std::uint8_t> bgr,
                            ImageView<std::uint8_t> gray) {
  assert(same_size(yuyv, bgr) && same_size(yuyv, gray) && yuyv.channels == 2 && yuyv.width % 2 == 0);
  const Coefficients c = coefficients_of(coding);
  const VectorPixels vectors(c);
  for (int y = 0; y < yuyv.height; ++y) {
    const std::uint8_t* __restrict from = yuyv.row(y);
    std::uint8_t* __restrict color = bgr.row(y);
    std::uint8_t* __restrict grey = gray.row(y);
    int x = 0;
    for (; x + VectorPixels::kPixels <= yuyv.width; x += VectorPixels::kPixels, from += 2 * VectorPixels::kPixels) {
      v_uint8 luma, uv;
      cv::v_load_deinterleave(from, luma, uv);
      vectors.write(luma, uv, color + 3 * x, grey + x);
    }
    for (; x < yuyv.width; x += 2, from += 4) {
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
  const VectorPixels vectors(c);
  for (int y = 0; y < luma.height; ++y) {
    const std::uint8_t* __restrict from = luma.row(y);
    const std::uint8_t* __restrict uv = chroma.row(y / 2);
    std::uint8_t* __restrict color = bgr.row(y);
    std::uint8_t* __restrict grey = gray.row(y);
    int x = 0;
    for (; x + VectorPixels::kPixels <= luma.width; x += VectorPixels::kPixels) {
      vectors.write(cv::vx_load(from + x), cv::vx_load(uv + x), color + 3 * x, grey + x);
    }
    for (; x < luma.width; x += 2) {
      const Chroma both = chroma_of(c, uv[x], uv[x + 1]);
      write_pixel(c, from[x], both, color + 3 * x, grey + x);
      write_pixel(c, from[x + 1], both, color + 3 * x + 3, grey + x + 1);
    }
  }
}

}  // namespace posed
