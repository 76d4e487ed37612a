#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/detections.h"
#include "core/image_view.h"
#include "detect/network.h"

namespace posed {

/// What a network was trained to see.
struct PixelFormat {
  bool rgb = true;            ///< order of the channels; false: blue, green, red
  float scale = 1.0F / 255;   ///< of 8-bit values
  std::uint8_t border = 114;  ///< 8-bit value around the image
};

/// Fits an image into a network's input: resized with its proportions kept, centred, with a grey border. Shrinking averages what
/// falls on a pixel (as cv::INTER_AREA), enlarging interpolates linearly. Keeps buffers and tables of the last size of image, so
/// that a stream of images of one size allocates nothing after the first. Thread-bound.
class Letterbox {
 public:
  /// `input` has three channels.
  Letterbox(TensorShape input, PixelFormat format);

  /// Fills `planes`, channels before rows before columns, from 8-bit blue, green and red.
  void place(ImageView<const std::uint8_t> bgr, std::span<float> planes);

  /// A box in the network's input [pixels, the first one from 0 to 1] in coordinates of the image placed last, cut to it.
  BoundingBox to_image(const BoundingBox& box) const;

 private:
  /// One output coordinate: weights of the source coordinates from `first` on.
  struct Taps {
    int first = 0;
    int count = 0;
    int weights = 0;  ///< index into the weights
  };
  struct Axis {
    std::vector<Taps> taps;
    std::vector<float> weights;
  };
  static Axis make_axis(int source, int target);
  void prepare(int width, int height);
  void resize_row(ImageView<const std::uint8_t> bgr, int y);

  TensorShape input_;
  PixelFormat format_;
  int image_width_ = 0;
  int image_height_ = 0;
  int resized_width_ = 0;
  int resized_height_ = 0;
  int left_ = 0;
  int top_ = 0;
  Axis columns_;
  Axis rows_;
  std::vector<float> source_row_;  // one output row at the source's width, interleaved
};

}  // namespace posed
