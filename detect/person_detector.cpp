#include "detect/person_detector.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "detect/network_loader.h"
#include "detect/network_runner.h"
#include "detect/opencv_network.h"

namespace posed {

namespace {

constexpr int kWarmUpRuns = 2;  // first touch of the weights
constexpr int kTimedRuns = 5;

bool has_memory(const DetectorConfig& config) {
  return config.memory_s > 0;
}

/// A memory wants to know of boxes too unsure to be reported.
DetectorConfig before_memory(DetectorConfig config) {
  config.score = has_memory(config) ? std::min<double>(config.score, PersonMemory::kUnsureScore) : config.score;
  return config;
}

DetectionThresholds thresholds(const DetectorConfig& config) {
  return {static_cast<float>(config.score), static_cast<float>(config.iou)};
}

HeadKind head_kind(DetectorHead head) {
  switch (head) {
    case DetectorHead::Anchors: return HeadKind::Anchors;
    case DetectorHead::Boxes: return HeadKind::Boxes;
    case DetectorHead::Yolox: return HeadKind::Yolox;
  }
  return HeadKind::Anchors;
}

/// Where a calibrated network runs in 8 bits. oneDNN has fast ways to on every x86-64 (half to three quarters of floats' time); on
/// other processors it may have but its reference, many times slower. By the architecture, not by a clock: a replay must repeat.
#ifdef __x86_64__
constexpr bool kEightBitsAreFast = true;
#else
constexpr bool kEightBitsAreFast = false;
#endif

using Look = Result<std::shared_ptr<ObjectDetector>>;

Look load_own(const DetectorConfig& config, const ModelName& name, NetworkLoader& networks) {
  Result<Network> network = networks.load(name);
  if (!network) {
    return tl::unexpected<Error>(network.error());
  }
  const Precision precision = kEightBitsAreFast && !network->ranges().empty() ? Precision::Int8 : Precision::Float32;
  Result<std::unique_ptr<NetworkRunner>> runner = NetworkRunner::create(*network, precision);
  if (!runner) {
    return tl::unexpected<Error>(runner.error());
  }
  return ObjectDetector::create(std::move(*runner), network->metadata(), head_kind(config.head), config.person_class,
                                MultiScaleDetector::thresholds_of_looks(thresholds(config)));
}

Look load_opencv(const DetectorConfig& config, const ModelName& name) {
  if (!name.sizes.empty()) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: OpenCV takes networks at the size of their file", to_string(name)));
  }
  Result<std::unique_ptr<OpenCvNetwork>> engine = OpenCvNetwork::create(name.file);
  if (!engine) {
    return tl::unexpected<Error>(engine.error());
  }
  return ObjectDetector::create(std::move(*engine), {}, head_kind(config.head), config.person_class,
                                MultiScaleDetector::thresholds_of_looks(thresholds(config)));
}

/// Makes models of a configuration ready. Those that look at the same size of the same network share what is needed for it.
class ModelLoader {
 public:
  explicit ModelLoader(const DetectorConfig& config) : config_(config) {}

  Result<std::unique_ptr<MultiScaleDetector>> load(const ModelName& name) {
    std::vector<std::shared_ptr<ObjectDetector>> looks;
    for (const ModelName& single : one_by_one(name)) {
      std::shared_ptr<ObjectDetector>& look = looks_[to_string(single)];
      if (!look) {
        Look loaded = config_.engine == DetectorEngine::Posed ? load_own(config_, single, networks_) : load_opencv(config_, single);
        if (!loaded) {
          return tl::unexpected<Error>(loaded.error());
        }
        look = std::move(*loaded);
      }
      looks.push_back(look);
    }
    return std::make_unique<MultiScaleDetector>(std::move(looks), thresholds(config_));
  }

 private:
  static std::vector<ModelName> one_by_one(const ModelName& name) {
    if (name.sizes.empty()) {
      return {name};
    }
    std::vector<ModelName> single;
    for (const InputSize& size : name.sizes) {
      single.push_back({name.file, {size}});
    }
    return single;
  }

  const DetectorConfig& config_;
  NetworkLoader networks_;
  std::map<std::string, std::shared_ptr<ObjectDetector>> looks_;
};

/// Median of a few runs, the deadline far away.
Result<TimeNs> measure(MultiScaleDetector& detector, ImageView<const std::uint8_t> bgr, const Clock& clock) {
  Detections found;
  std::vector<TimeNs> times;
  for (int i = 0; i < kWarmUpRuns + kTimedRuns; ++i) {
    const Result<MultiScaleOutcome> outcome = detector.detect(bgr, Deadline{&clock}, found);
    if (!outcome) {
      return tl::unexpected<Error>(outcome.error());
    }
    if (i >= kWarmUpRuns) {
      times.push_back(std::max<TimeNs>(outcome->elapsed_ns, 1));
    }
  }
  std::nth_element(times.begin(), times.begin() + kTimedRuns / 2, times.end());
  return times[kTimedRuns / 2];
}

Error blame_config(const Error& error) {
  return {ErrorCode::InvalidConfig, fmt::format("detector.models: {}", error.message)};
}

}  // namespace

Result<std::unique_ptr<MultiScaleDetector>> load_object_detector(const DetectorConfig& config, const ModelName& name) {
  return ModelLoader(config).load(name);
}

Result<std::unique_ptr<PersonDetector>> PersonDetector::create(const DetectorConfig& config, int image_width, int image_height,
                                                               const Clock& clock) {
  struct Loaded {
    std::unique_ptr<MultiScaleDetector> model;
    std::string name;
    TimeNs unloaded_ns;
  };
  std::vector<std::uint8_t> grey(static_cast<std::size_t>(image_width) * static_cast<std::size_t>(image_height) * 3, 128);
  const ImageView<const std::uint8_t> bgr{grey.data(), image_width, image_height, std::ptrdiff_t{3} * image_width, 3};
  const DetectorConfig before = before_memory(config);
  ModelLoader loader(before);
  std::vector<Loaded> loaded;
  for (const std::string& file : config.models) {
    Result<std::unique_ptr<MultiScaleDetector>> model = loader.load(parse_model_name(file));
    if (!model) {
      return tl::unexpected<Error>(blame_config(model.error()));
    }
    const Result<TimeNs> unloaded_ns = measure(**model, bgr, clock);
    if (!unloaded_ns) {
      return tl::unexpected<Error>(blame_config(unloaded_ns.error()));
    }
    loaded.push_back({std::move(*model), std::filesystem::path(file).filename().string(), *unloaded_ns});
  }
  if (loaded.empty()) {
    return make_error(ErrorCode::InvalidConfig, "detector.models: is empty; name at least one, or set detector.enabled = false");
  }
  std::vector<std::unique_ptr<MultiScaleDetector>> models;
  std::vector<std::string> names;
  std::vector<TimeNs> unloaded_ns;
  for (Loaded& l : loaded) {
    models.push_back(std::move(l.model));
    names.push_back(std::move(l.name));
    // The order is the user's; a larger model that measured faster, by noise, is taken to be as fast as the one before it.
    unloaded_ns.push_back(std::max(l.unloaded_ns, unloaded_ns.empty() ? TimeNs{0} : unloaded_ns.back()));
  }
  return std::unique_ptr<PersonDetector>(
      new PersonDetector(config, clock, std::move(models), std::move(names), std::move(unloaded_ns)));
}

PersonDetector::PersonDetector(const DetectorConfig& config, const Clock& clock,
                               std::vector<std::unique_ptr<MultiScaleDetector>> models, std::vector<std::string> names,
                               std::vector<TimeNs> unloaded_ns)
    : budget_ns_(from_seconds(config.budget_s)),
      least_score_(static_cast<float>(config.score)),
      clock_(clock),
      models_(std::move(models)),
      names_(std::move(names)),
      unloaded_ns_(std::move(unloaded_ns)),
      ladder_(unloaded_ns_, budget_ns_) {
  if (has_memory(config)) {
    memory_.emplace(from_seconds(config.memory_s));
  }
}

Result<DetectionOutcome> PersonDetector::detect(const RgbdFrame& frame, Detections& found) {
  const std::size_t model = ladder_.rung();
  Result<DetectionOutcome> outcome = run(frame, model, {&clock_, clock_.now_ns() + budget_ns_}, found);
  if (outcome) {
    outcome->overrun_ns = std::max<TimeNs>(outcome->elapsed_ns - budget_ns_, 0);
    if (outcome->finished && !outcome->cut_short) {
      ladder_.record_finished(model, outcome->elapsed_ns);
    } else {
      ladder_.record_abandoned(model, outcome->elapsed_ns);
    }
  }
  return outcome;
}

Result<DetectionOutcome> PersonDetector::detect_unhurried(const RgbdFrame& frame, std::size_t model, Detections& found) {
  return run(frame, std::min(model, models_.size() - 1), Deadline{&clock_}, found);
}

Result<DetectionOutcome> PersonDetector::run(const RgbdFrame& frame, std::size_t model, const Deadline& deadline,
                                             Detections& found) {
  const Result<MultiScaleOutcome> outcome = models_[model]->detect(frame.bgr, deadline, found);
  if (!outcome) {
    return tl::unexpected<Error>(outcome.error());
  }
  found.sequence = frame.sequence;
  found.capture_ns = frame.capture_ns;
  found.stamp_utc_ns = frame.stamp_utc_ns;
  found.image_width = frame.bgr.width;
  found.image_height = frame.bgr.height;
  found.detect_ns = outcome->elapsed_ns;
  found.model = static_cast<std::uint32_t>(model);
  const bool is_known = outcome->sizes_done > 0;
  if (is_known && memory_) {
    memory_->judge(found);
    found.drop_below(least_score_);
  }
  return DetectionOutcome{is_known, model, outcome->elapsed_ns, 0, outcome->longest_step_ns, is_known && !outcome->finished};
}

}  // namespace posed
