#include "detect/multi_scale_detector.h"

#include <algorithm>
#include <utility>

namespace posed {

MultiScaleDetector::MultiScaleDetector(std::vector<std::shared_ptr<ObjectDetector>> sizes, DetectionThresholds thresholds)
    : sizes_(std::move(sizes)), least_score_(thresholds.score), fusion_(thresholds.iou) {}

DetectionThresholds MultiScaleDetector::thresholds_of_looks(const DetectionThresholds& thresholds) {
  return {std::min(thresholds.score, kLeastScore), thresholds.iou};
}

Result<MultiScaleOutcome> MultiScaleDetector::detect(ImageView<const std::uint8_t> bgr, const Deadline& deadline,
                                                     Detections& found) {
  MultiScaleOutcome all;
  const TimeNs begin_ns = deadline.clock->now_ns();
  for (const std::shared_ptr<ObjectDetector>& size : sizes_) {
    const bool is_first = all.sizes_done == 0;
    const Result<RunOutcome> outcome = size->detect(bgr, deadline, is_first ? found : look_);
    if (!outcome) {
      return tl::unexpected<Error>(outcome.error());
    }
    all.longest_step_ns = std::max(all.longest_step_ns, outcome->longest_step_ns);
    if (!outcome->finished) {
      break;
    }
    if (!is_first) {
      fusion_.add(look_, all.sizes_done, found);
    }
    ++all.sizes_done;
  }
  found.drop_below(least_score_);
  all.finished = all.sizes_done == sizes_.size();
  all.elapsed_ns = deadline.clock->now_ns() - begin_ns;
  return all;
}

}  // namespace posed
