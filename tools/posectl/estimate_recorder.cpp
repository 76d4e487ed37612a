#include "tools/posectl/estimate_recorder.h"

namespace posed {

void EstimateRecorder::record(const PoseEstimate& estimate) {
  frames_.push_back({estimate.sequence, estimate.stamp_utc_ns});
  if (estimate.has_pose()) {
    records_.push_back({estimate.stamp_utc_ns, estimate.T_map_camera(), estimate.reference_keyframe, estimate.T_reference_camera});
    residual_variances_ += estimate.residual_variance;
  }
}

double EstimateRecorder::residual_variance() const {
  return records_.empty() ? 0.0 : residual_variances_ / static_cast<double>(records_.size());
}

Trajectory EstimateRecorder::online_trajectory() const {
  Trajectory trajectory;
  trajectory.reserve(records_.size());
  for (const Record& record : records_) {
    trajectory.push_back({record.stamp_utc_ns, record.T_map_camera});
  }
  return trajectory;
}

EstimateRecorder::Final EstimateRecorder::final_trajectory(
    const std::function<std::optional<Se3>(std::uint64_t)>& keyframe_pose) const {
  Final result;
  result.trajectory.reserve(records_.size());
  for (const Record& record : records_) {
    if (const std::optional<Se3> T_map_keyframe = keyframe_pose(record.reference_keyframe)) {
      result.trajectory.push_back({record.stamp_utc_ns, *T_map_keyframe * record.T_reference_camera});
    } else {
      ++result.without_keyframe;
    }
  }
  return result;
}

}  // namespace posed
