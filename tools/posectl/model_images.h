#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "core/result.h"
#include "detect/letterbox.h"
#include "detect/network.h"
#include "tools/posectl/color_image.h"

namespace posed {

/// Image files as inputs of a network, as the detector would give it them. Thread-bound.
class ModelImages {
 public:
  ModelImages(std::vector<std::filesystem::path> paths, TensorShape input)
      : paths_(std::move(paths)), input_(input), letterbox_(input, {}) {}

  std::size_t count() const { return paths_.size(); }

  /// Red, green and blue planes in [0, 1]. Errors: as ColorImage; InvalidArgument where the network takes no three channels.
  Status fill(std::size_t index, std::span<float> input);

 private:
  std::vector<std::filesystem::path> paths_;
  TensorShape input_;
  Letterbox letterbox_;
  ColorImage image_;
};

}  // namespace posed
