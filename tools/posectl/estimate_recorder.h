#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/estimates.h"
#include "core/se3.h"
#include "tools/posectl/trajectory.h"

namespace posed {

/// Keeps what the tracker said of each frame, to write trajectories from. Thread-bound at any one time: the pipeline's publisher
/// thread records; once the pipeline has stopped, its owner reads.
class EstimateRecorder {
 public:
  explicit EstimateRecorder(std::size_t expected_frames) {
    records_.reserve(expected_frames);
    frames_.reserve(expected_frames);
  }

  void record(const PoseEstimate& estimate);

  /// T_map_camera as published at the time. Stamps: those of the colour images.
  Trajectory online_trajectory() const;

  struct Final {
    Trajectory trajectory;
    std::size_t without_keyframe = 0;  ///< poses left out because their reference keyframe is unknown
  };
  /// T_map_camera rebuilt from where the reference keyframes are now.
  Final final_trajectory(const std::function<std::optional<Se3>(std::uint64_t)>& keyframe_pose) const;

  /// Mean of PoseEstimate::residual_variance over the frames with a pose; 0 where there are none.
  double residual_variance() const;

  struct Frame {
    std::uint64_t sequence = 0;
    std::int64_t stamp_utc_ns = 0;
  };
  /// Every frame that was processed, with a pose or without, in order.
  const std::vector<Frame>& frames() const { return frames_; }

 private:
  struct Record {
    std::int64_t stamp_utc_ns = 0;
    Se3 T_map_camera;
    std::uint64_t reference_keyframe = 0;
    Se3 T_reference_camera;
  };
  std::vector<Record> records_;    // of frames with a pose
  double residual_variances_ = 0;  // their sum
  std::vector<Frame> frames_;
};

}  // namespace posed
