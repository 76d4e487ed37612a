#include "drivers/v4l2/v4l2_source.h"

#include "drivers/camera_source.h"
#include "drivers/v4l2/v4l2_camera.h"
#include "drivers/v4l2/v4l2_system.h"

namespace posed {

Result<std::unique_ptr<RgbdSource>> make_v4l2_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock) {
  if (config.v4l2.device.empty()) {
    return make_error(ErrorCode::InvalidArgument, "source.v4l2.device is empty: it must name the node of the colour camera");
  }
  if (config.depth.node.device.empty()) {
    return make_error(ErrorCode::Unsupported,
                      "source.depth.device is empty: a colour camera alone cannot be tracked in metres, it needs the node of a "
                      "depth camera beside it");
  }
  const CameraSourceOptions options{camera.width, camera.height, config.live, config.pacing};
  return make_camera_source(std::make_unique<V4l2Camera>(machine_v4l2(), config, camera, clock), options, clock);
}

}  // namespace posed
