#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/se3.h"
#include "slam/map_snapshot.h"
#include "slam/pose_solver.h"

namespace posed {

/// The covariance of a pose against the map's origin: the solver takes the landmarks as exact, but their own error is that of the
/// keyframes they hang on (slam/drift_model.h). `landmark_of`: by keypoint, an index into the map or kUnmatched. `anchors` keeps
/// its memory from call to call. Reentrant.
Matrix6d pose_covariance(const PoseSolution& solution, std::span<const std::int32_t> landmark_of, const MapSnapshot& map,
                         std::vector<std::uint32_t>& anchors);

}  // namespace posed
