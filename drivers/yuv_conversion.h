#pragma once

#include <cstddef>
#include <cstdint>

#include "core/image_view.h"

/// YUV images of cameras to what a frame holds. Integers in a fixed order, so the same on every machine. Reentrant.
namespace posed {

enum class YuvMatrix : std::uint8_t { Bt601, Bt709 };
enum class YuvRange : std::uint8_t {
  Limited,  ///< luma 16 to 235, chroma 16 to 240
  Full,     ///< both 0 to 255
};

/// What the numbers of a YUV image mean.
struct YuvCoding {
  YuvMatrix matrix = YuvMatrix::Bt601;
  YuvRange range = YuvRange::Limited;
};

/// YUYV (4:2:2, Y0 U Y1 V): `yuyv` has two channels a pixel, luma and, in turns, U and V. The grey image is the luma, stretched to
/// 0 to 255 where its range is limited. All views have the same size; the width is even.
void bgr_and_gray_from_yuyv(ImageView<const std::uint8_t> yuyv, YuvCoding coding, ImageView<std::uint8_t> bgr,
                            ImageView<std::uint8_t> gray);

/// NV12 (4:2:0): `luma` has the size of the others, and `chroma` half its height, two bytes (U, V) for each pair of columns: a view
/// of the same width with one channel. Width and height are even.
void bgr_and_gray_from_nv12(ImageView<const std::uint8_t> luma, ImageView<const std::uint8_t> chroma, YuvCoding coding,
                            ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);

}  // namespace posed
