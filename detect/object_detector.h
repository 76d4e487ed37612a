#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/detections.h"
#include "core/image_view.h"
#include "core/result.h"
#include "detect/box_decoder.h"
#include "detect/inference_engine.h"
#include "detect/letterbox.h"
#include "detect/network.h"

namespace posed {

/// Which boxes are reported.
struct DetectionThresholds {
  float score = 0.4F;  ///< least confidence
  float iou = 0.5F;    ///< of two boxes that overlap by more, the less confident one goes
};

/// Image to boxes: letterbox, network, decoding, suppression. Keeps its buffers: after the first image of a size it allocates
/// nothing itself (OpenCV's engine does). Thread-bound.
class ObjectDetector {
 public:
  /// `wanted` is the class whose boxes count. Error: BadData, where outputs, metadata and `head` do not fit; the message begins
  /// with the engine's name.
  static Result<std::unique_ptr<ObjectDetector>> create(std::unique_ptr<InferenceEngine> engine, const NetworkMetadata& metadata,
                                                        HeadKind head, int wanted, DetectionThresholds thresholds);

  /// Overwrites the boxes of `found`, most confident first; where the deadline passed first there are none, and the outcome says
  /// so. Steps and time are of all that is done, the letterbox and the decoding included. Error: Unavailable, as of the engine.
  Result<RunOutcome> detect(ImageView<const std::uint8_t> bgr, const Deadline& deadline, Detections& found);

  std::string_view name() const { return engine_->name(); }
  TensorShape input_shape() const { return engine_->input_shape(); }

 private:
  ObjectDetector(std::unique_ptr<InferenceEngine> engine, Letterbox letterbox, BoxDecoder decoder, DetectionThresholds thresholds);

  std::unique_ptr<InferenceEngine> engine_;
  Letterbox letterbox_;
  BoxDecoder decoder_;
  DetectionThresholds thresholds_;
  std::vector<Candidate> candidates_;
};

}  // namespace posed
