#include "daemon/app.h"

#include <utility>

#include "daemon/message_transport.h"
#include "daemon/pipeline.h"
#include "daemon/slam_ports.h"

namespace posed {

MapFiles map_files(const MapConfig& config) {
  if (config.mode == MapMode::Localization) {
    return {config.file, false, ""};
  }
  return {config.file, true, config.file};
}

Result<std::unique_ptr<App>> App::create(const Config& config, AppOptions options, const Clock& clock) {
  Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config.source, config.intrinsics, clock);
  if (!source) {
    return tl::unexpected<Error>(source.error());
  }
  PipelineParts parts;
  parts.source = std::move(*source);
  parts.tracker = make_frame_tracker(config);
  parts.mapper = make_keyframe_mapper(config);
  const SourceInfo& info = parts.source->info();
  Result<std::unique_ptr<FrameDetector>> detector = make_frame_detector(config.detector, info.width, info.height, clock);
  if (!detector) {
    return tl::unexpected<Error>(detector.error());
  }
  parts.detector = std::move(*detector);
  if (options.publish) {
    parts.transport = std::make_unique<LcmTransport>(config.publisher.url);
  }
  return make_pipeline(config, std::move(options), clock, std::move(parts));
}

}  // namespace posed
