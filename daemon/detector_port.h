#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "config/config.h"
#include "core/clock.h"
#include "core/detections.h"
#include "core/result.h"
#include "core/rgbd_frame.h"
#include "detect/person_detector.h"

namespace posed {

/// The person detector as the pipeline sees it (detect/person_detector.h), so that the pipeline can be tested without networks.
/// Thread-bound, but for `model_name`, which is thread-safe.
class FrameDetector {
 public:
  virtual ~FrameDetector() = default;

  /// Within the budget.
  virtual Result<DetectionOutcome> detect(const RgbdFrame& frame, Detections& found) = 0;

  /// As long as it takes, with the model of the configuration: a function of the images so far alone.
  virtual Result<DetectionOutcome> detect_unhurried(const RgbdFrame& frame, Detections& found) = 0;

  virtual std::string model_name(std::size_t model) const = 0;
};

/// The real one, for frames of that size; null where the configuration says that nobody is to be looked for. Errors as in
/// `PersonDetector::create`. `clock` must outlive it. Reentrant.
Result<std::unique_ptr<FrameDetector>> make_frame_detector(const DetectorConfig& config, int image_width, int image_height,
                                                           const Clock& clock);

}  // namespace posed
