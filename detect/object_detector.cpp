#include "detect/object_detector.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr std::size_t kExpectedCandidates = 4096;  // room made at the start; a crowd may take more once

/// YOLOX was trained on blue, green, red from 0 to 255.
PixelFormat format_of(HeadKind head) {
  return head == HeadKind::Yolox ? PixelFormat{false, 1.0F, 114} : PixelFormat{};
}

}  // namespace

Result<std::unique_ptr<ObjectDetector>> ObjectDetector::create(std::unique_ptr<InferenceEngine> engine,
                                                               const NetworkMetadata& metadata, HeadKind head, int wanted,
                                                               DetectionThresholds thresholds) {
  const TensorShape input = engine->input_shape();
  if (input.channels != 3) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: takes {} channels; a colour image has 3", engine->name(), input.channels));
  }
  Result<BoxDecoder> decoder = BoxDecoder::create(head, input, engine->outputs(), metadata, wanted);
  if (!decoder) {
    return make_error(decoder.error().code, fmt::format("{}: {}", engine->name(), decoder.error().message));
  }
  return std::unique_ptr<ObjectDetector>(
      new ObjectDetector(std::move(engine), Letterbox(input, format_of(head)), std::move(*decoder), thresholds));
}

ObjectDetector::ObjectDetector(std::unique_ptr<InferenceEngine> engine, Letterbox letterbox, BoxDecoder decoder,
                               DetectionThresholds thresholds)
    : engine_(std::move(engine)), letterbox_(std::move(letterbox)), decoder_(std::move(decoder)), thresholds_(thresholds) {
  candidates_.reserve(kExpectedCandidates);
}

Result<RunOutcome> ObjectDetector::detect(ImageView<const std::uint8_t> bgr, const Deadline& deadline, Detections& found) {
  found.count = 0;
  const TimeNs begin_ns = deadline.clock->now_ns();
  letterbox_.place(bgr, engine_->input());
  const TimeNs placed_ns = deadline.clock->now_ns();
  Result<RunOutcome> outcome = engine_->run(deadline);
  if (!outcome) {
    return outcome;
  }
  const TimeNs ran_ns = deadline.clock->now_ns();
  TimeNs end_ns = ran_ns;
  if (outcome->finished) {
    decoder_.decode(engine_->outputs(), thresholds_.score, candidates_);
    suppress_overlaps(candidates_, thresholds_.iou, Detections::kCapacity);
    for (const Candidate& candidate : candidates_) {
      const Detection detection{letterbox_.to_image(candidate.detection.box), candidate.detection.score};
      if (detection.box.area() > 0) {  // not beside the image
        found.people[found.count++] = detection;
      }
    }
    end_ns = deadline.clock->now_ns();
    ++outcome->steps_run;
  }
  ++outcome->steps_run;
  outcome->elapsed_ns = end_ns - begin_ns;
  outcome->longest_step_ns = std::max({outcome->longest_step_ns, placed_ns - begin_ns, end_ns - ran_ns});
  return outcome;
}

}  // namespace posed
