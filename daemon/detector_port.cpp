#include "daemon/detector_port.h"

#include <utility>

#include "core/logging.h"

namespace posed {

namespace {

class NetworkDetector final : public FrameDetector {
 public:
  NetworkDetector(std::unique_ptr<PersonDetector> detector, std::size_t lockstep_model)
      : detector_(std::move(detector)), lockstep_model_(lockstep_model) {}

  Result<DetectionOutcome> detect(const RgbdFrame& frame, Detections& found) override { return detector_->detect(frame, found); }
  Result<DetectionOutcome> detect_unhurried(const RgbdFrame& frame, Detections& found) override {
    return detector_->detect_unhurried(frame, lockstep_model_, found);
  }
  std::string model_name(std::size_t model) const override { return detector_->model_name(model); }

 private:
  std::unique_ptr<PersonDetector> detector_;
  std::size_t lockstep_model_;
};

}  // namespace

Result<std::unique_ptr<FrameDetector>> make_frame_detector(const DetectorConfig& config, int image_width, int image_height,
                                                           const Clock& clock) {
  if (!config.enabled) {
    return nullptr;
  }
  Result<std::unique_ptr<PersonDetector>> detector = PersonDetector::create(config, image_width, image_height, clock);
  if (!detector) {
    return tl::unexpected<Error>(detector.error());
  }
  for (std::size_t i = 0; i < (*detector)->model_count(); ++i) {
    log_info("detector: {} takes {:.1f} ms", (*detector)->model_name(i), to_ms((*detector)->unloaded_ns(i)));
  }
  return std::make_unique<NetworkDetector>(std::move(*detector), static_cast<std::size_t>(config.lockstep_model));
}

}  // namespace posed
