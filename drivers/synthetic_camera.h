#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "config/config.h"
#include "core/result.h"
#include "core/rgbd_frame.h"
#include "drivers/synthetic_renderer.h"
#include "drivers/synthetic_sensor.h"
#include "drivers/synthetic_world.h"

namespace posed {

/// The synthetic RGB-D camera as a function from a frame's index to the frame: what the live source delivers, and what a writer of
/// recordings takes, person masks and exact poses included. Equal configuration and intrinsics give equal bytes, whatever was
/// rendered before. Thread-bound.
class SyntheticCamera {
 public:
  /// 2023-11-14 22:13:20 UTC: `stamp_utc_ns` of frame 0, fixed so that recordings are identical.
  static constexpr std::int64_t kEpochUtc_ns = 1'700'000'000'000'000'000;

  /// Errors: InvalidArgument (people, rate, duration or image size out of range, or people in a world without them). Paints the
  /// world: tenths of a second.
  static Result<std::unique_ptr<SyntheticCamera>> create(const SyntheticConfig& config, const CameraIntrinsics& camera);

  /// Renders frame `index` into views of the camera's size and sets sequence, stamp_utc_ns and T_world_camera_truth; capture_ns
  /// stays as it is. `person_mask` may be empty, else it is 255 on people and 0 elsewhere. Errors: InvalidArgument (a view's size
  /// differs).
  Status render(std::uint64_t index, RgbdFrame& frame, ImageView<std::uint8_t> person_mask = {});

  /// When frame `index` is due, from frame 0.
  TimeNs due_ns(std::uint64_t index) const;

  /// Exact pose of frame `index`; world: z up, the floor's middle at the origin.
  Se3 pose(std::uint64_t index) const { return world_.camera_pose(to_seconds(due_ns(index))); }

  /// Frames of the configured duration; 0 where it is endless.
  std::uint64_t total_frames() const { return total_frames_; }

  const CameraIntrinsics& intrinsics() const { return camera_; }
  const SyntheticWorld& world() const { return world_; }

 private:
  SyntheticCamera(const SyntheticConfig& config, const CameraIntrinsics& camera);

  SyntheticConfig config_;
  CameraIntrinsics camera_;
  std::uint64_t total_frames_ = 0;
  SyntheticWorld world_;
  SyntheticRenderer renderer_;
  SyntheticSensor sensor_;
  std::vector<PackedBgr> colour_;
  std::vector<float> depth_m_;
};

}  // namespace posed
