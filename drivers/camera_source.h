#pragma once

#include <memory>

#include "config/config.h"
#include "core/clock.h"
#include "drivers/camera.h"
#include "drivers/rgbd_source.h"

namespace posed {

struct CameraSourceOptions {
  int width = 640;
  int height = 480;
  LiveConfig live;
  Pacing pacing = Pacing::Realtime;  ///< Lockstep, for recordings: no slot is waited for in vain and nothing counts as a stall
};

/// A source that keeps to its camera: opens it, delivers its frames with stamps that always increase, and where the camera goes
/// away or falls silent, closes it and tries again, at once and then at growing intervals (50 ms, doubled up to
/// live.retry_period_s). It starts whether the camera is there or not. `clock` must outlive it.
std::unique_ptr<RgbdSource> make_camera_source(std::unique_ptr<Camera> camera, const CameraSourceOptions& options,
                                               const Clock& clock);

}  // namespace posed
