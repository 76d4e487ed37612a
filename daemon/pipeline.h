#pragma once

#include <memory>

#include "config/config.h"
#include "core/clock.h"
#include "core/result.h"
#include "daemon/app.h"
#include "daemon/detector_port.h"
#include "daemon/message_transport.h"
#include "daemon/slam_ports.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// What the pipeline is made of.
struct PipelineParts {
  std::unique_ptr<RgbdSource> source;
  std::unique_ptr<FrameTracker> tracker;
  std::unique_ptr<KeyframeMapper> mapper;
  std::unique_ptr<FrameDetector> detector;      ///< null: nobody is looked for
  std::unique_ptr<MessageTransport> transport;  ///< null: nothing is published
};

/// `App::create` with parts of the caller's choice. Errors: InvalidConfig, where a queue or the pool of the configuration
/// has no place, or the map cannot be used; NotFound and Io of the map's file.
Result<std::unique_ptr<App>> make_pipeline(const Config& config, AppOptions options, const Clock& clock, PipelineParts parts);

}  // namespace posed
