#pragma once

#include <memory>

#include "drivers/rgbd_source.h"

namespace posed {

/// A live camera in the synthetic world (`drivers/synthetic_camera.h`). With Pacing::Realtime frame i is due at start + i / rate:
/// it is rendered before and handed out then; where rendering falls behind by a period, the frames that have passed are left out
/// and `sequence` has a gap; its stamps are the clock's. With Pacing::Lockstep every frame comes as soon as it is rendered and
/// asked for; capture_ns is that moment, stamp_utc_ns counts from SyntheticCamera::kEpochUtc_ns. `clock` must outlive the source.
/// Errors: InvalidArgument (a value out of range).
Result<std::unique_ptr<RgbdSource>> make_synthetic_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                          const Clock& clock);

}  // namespace posed
