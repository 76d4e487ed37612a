#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "config/model_name.h"
#include "core/clock.h"
#include "core/detections.h"
#include "core/image_view.h"
#include "core/result.h"
#include "core/rgbd_frame.h"
#include "detect/multi_scale_detector.h"
#include "detect/person_memory.h"
#include "detect/rung_ladder.h"

namespace posed {

/// What became of one frame.
struct DetectionOutcome {
  bool finished = false;       ///< false: the budget was spent, and nothing is known of this frame
  std::size_t model = 0;       ///< that looked, or tried to
  TimeNs elapsed_ns = 0;       ///< all of it
  TimeNs overrun_ns = 0;       ///< past the budget; 0 within it
  TimeNs longest_step_ns = 0;  ///< of this run: what bounds the overrun, but for what the scheduler adds
  bool cut_short = false;      ///< finished, but the budget was spent before all sizes of the model were looked at
};

/// Finds people within a time budget: of the configured models it takes the largest that fits, and gives a frame up when the
/// budget is spent; of a model that looks at several sizes, what the first ones show is kept. What a model says of a frame is
/// judged by what was seen in those before (detect/person_memory.h), unless the configuration gives no memory. Thread-bound;
/// everything is allocated by `create`.
class PersonDetector {
 public:
  /// Loads the models and measures each on this machine, a few runs of a blank image of the given size. Errors: InvalidConfig,
  /// which names `detector.models` and the file, where one cannot be used. `clock` must outlive it.
  static Result<std::unique_ptr<PersonDetector>> create(const DetectorConfig& config, int image_width, int image_height,
                                                        const Clock& clock);

  /// In real time. Error: Unavailable, where an engine's library fails.
  Result<DetectionOutcome> detect(const RgbdFrame& frame, Detections& found);

  /// With a model of the caller's choice and as long as it takes, so that the outcome is a function of the images so far alone.
  Result<DetectionOutcome> detect_unhurried(const RgbdFrame& frame, std::size_t model, Detections& found);

  std::size_t model_count() const { return models_.size(); }
  /// A model as the configuration names it, without its folder.
  const std::string& model_name(std::size_t model) const { return names_[model]; }
  /// What a run of a model took when the detector was made.
  TimeNs unloaded_ns(std::size_t model) const { return unloaded_ns_[model]; }

 private:
  PersonDetector(const DetectorConfig& config, const Clock& clock, std::vector<std::unique_ptr<MultiScaleDetector>> models,
                 std::vector<std::string> names, std::vector<TimeNs> unloaded_ns);
  Result<DetectionOutcome> run(const RgbdFrame& frame, std::size_t model, const Deadline& deadline, Detections& found);

  TimeNs budget_ns_;
  float least_score_;
  std::optional<PersonMemory> memory_;
  const Clock& clock_;
  std::vector<std::unique_ptr<MultiScaleDetector>> models_;
  std::vector<std::string> names_;
  std::vector<TimeNs> unloaded_ns_;
  RungLadder ladder_;
};

/// Makes one model ready as the configuration says: for tools that look at single images. Errors as in `PersonDetector::create`.
Result<std::unique_ptr<MultiScaleDetector>> load_object_detector(const DetectorConfig& config, const ModelName& name);

}  // namespace posed
