#include "slam/pose_covariance.h"

#include <algorithm>

#include "slam/drift_model.h"
#include "slam/projection_matcher.h"

namespace posed {

Matrix6d pose_covariance(const PoseSolution& solution, std::span<const std::int32_t> landmark_of, const MapSnapshot& map,
                         std::vector<std::uint32_t>& anchors) {
  anchors.clear();
  for (const std::int32_t landmark : landmark_of) {
    if (landmark != kUnmatched) {
      anchors.push_back(map.landmarks[static_cast<std::size_t>(landmark)].anchor);
    }
  }
  std::sort(anchors.begin(), anchors.end());
  InheritedDrift inherited;
  for (auto first = anchors.cbegin(); first != anchors.cend();) {
    const auto last = std::upper_bound(first, anchors.cend(), *first);
    const SnapshotAnchor& anchor = map.anchors[*first];
    inherited.add(static_cast<int>(last - first), anchor.T_map_camera.inverse() * solution.T_map_camera, anchor.covariance);
    first = last;
  }
  return inherited.covariance(solution.covariance);
}

}  // namespace posed
