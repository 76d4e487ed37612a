#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "core/result.h"
#include "detect/network.h"

namespace posed {

enum class CalibrationMethod {
  MinMax,            ///< all values that occurred
  MeanSquaredError,  ///< the range whose 8-bit steps and clipping together cost the least squared error
};

/// Fills the network's input with image number `index`; called twice for each image.
using CalibrationImage = std::function<Status(std::size_t index, std::span<float> input)>;

/// The simplified network with the ranges that its tensors take over `count` images, for Precision::Int8. Some 50 images of what
/// the camera sees are enough. Reentrant. Errors: InvalidArgument, where there is no image; those of `image`; those of
/// NetworkRunner.
Result<Network> calibrate(const Network& network, std::size_t count, const CalibrationImage& image,
                          CalibrationMethod method = CalibrationMethod::MeanSquaredError);

}  // namespace posed
