#include "drivers/libcamera/libcamera_source.h"

#include "drivers/camera_source.h"
#include "drivers/libcamera/libcamera_camera.h"
#include "drivers/libcamera/libcamera_device.h"
#include "drivers/v4l2/v4l2_system.h"

namespace posed {

Result<std::unique_ptr<RgbdSource>> make_libcamera_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                          const Clock& clock) {
  if (config.depth.node.device.empty()) {
    return make_error(ErrorCode::Unsupported,
                      "source.depth.device is empty: a colour camera alone cannot be tracked in metres, it needs the node of a "
                      "depth camera beside it");
  }
  const CameraSourceOptions options{camera.width, camera.height, config.live, config.pacing};
  auto color = make_libcamera_device(config.libcamera, camera, config.live.rate_hz, clock);
  return make_camera_source(std::make_unique<LibcameraCamera>(std::move(color), machine_v4l2(), config, camera, clock), options,
                            clock);
}

}  // namespace posed
