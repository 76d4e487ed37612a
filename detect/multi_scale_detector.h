#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/detections.h"
#include "core/image_view.h"
#include "core/result.h"
#include "detect/box_fusion.h"
#include "detect/inference_engine.h"
#include "detect/object_detector.h"

namespace posed {

/// How far a look at all sizes came.
struct MultiScaleOutcome {
  std::size_t sizes_done = 0;  ///< before the deadline; 0: nothing is known of the image
  bool finished = false;       ///< all sizes were looked at
  TimeNs elapsed_ns = 0;
  TimeNs longest_step_ns = 0;
};

/// Looks at an image at one size after the other and joins what is found (`BoxFusion`): two sizes fail in different ways. Where the
/// deadline passes after the first of them, what the sizes done so far show is the answer. Allocates as `ObjectDetector` does.
/// Thread-bound.
class MultiScaleDetector {
 public:
  /// A look reports boxes from this score on, or from a lower one that is asked for: what one size is unsure of, another may see.
  static constexpr float kLeastScore = 0.03F;

  /// One detector a size, at least one, which others on the same thread may share; each reports all from
  /// `thresholds_of_looks(thresholds)` on.
  MultiScaleDetector(std::vector<std::shared_ptr<ObjectDetector>> sizes, DetectionThresholds thresholds);

  static DetectionThresholds thresholds_of_looks(const DetectionThresholds& thresholds);

  /// Overwrites the boxes of `found`, most confident first. Error: Unavailable, as of the engine.
  Result<MultiScaleOutcome> detect(ImageView<const std::uint8_t> bgr, const Deadline& deadline, Detections& found);

  /// Of the engine.
  std::string_view name() const { return sizes_.front()->name(); }

 private:
  std::vector<std::shared_ptr<ObjectDetector>> sizes_;
  float least_score_;
  BoxFusion fusion_;
  Detections look_;
};

}  // namespace posed
