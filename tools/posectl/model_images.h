#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "core/image_view.h"
#include "core/result.h"
#include "detect/network.h"
#include "drivers/image_file.h"

namespace posed {

/// Image files as inputs of a network: scaled to fit, the aspect kept, grey borders. Thread-bound.
class ModelImages {
 public:
  ModelImages(std::vector<std::filesystem::path> paths, TensorShape input) : paths_(std::move(paths)), input_(input) {}

  std::size_t count() const { return paths_.size(); }

  /// Red, green and blue planes in [0, 1]. Errors: as ImageDecoder; InvalidArgument where the network takes no three channels.
  Status fill(std::size_t index, std::span<float> input);

 private:
  std::vector<std::filesystem::path> paths_;
  TensorShape input_;
  ImageDecoder decoder_;
  std::vector<std::uint8_t> bgr_;
  std::vector<std::uint8_t> gray_;
};

/// Planar RGB of an interleaved BGR image, bilinear, centred. Reentrant.
void letterbox(const ImageView<const std::uint8_t>& bgr, const TensorShape& input, std::span<float> planes);

}  // namespace posed
