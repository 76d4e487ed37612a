#include "slam/landmark_visibility.h"

#include <algorithm>
#include <cmath>

#include "slam/projection_matcher.h"

namespace posed {

namespace {

constexpr int kLeastAround = 6;  // valid cells of nine that it takes to say anything

enum class Visibility { Unclear, Hidden, Refuted };

Visibility judge(const DynamicMask& mask, std::size_t cell, float landmark_depth_m) {
  const DepthGrid& depth = mask.depth();
  const float tolerance = depth_tolerance_m(landmark_depth_m);
  if (mask.cells()[cell] != 0 && depth[cell] > 0) {
    if (depth[cell] < landmark_depth_m - tolerance) {
      return Visibility::Hidden;
    }
    return depth[cell] < landmark_depth_m + tolerance ? Visibility::Refuted : Visibility::Unclear;
  }
  int valid = 0;
  bool hidden = true;
  bool through = true;
  const auto look = [&](std::size_t c) {
    if (depth[c] > 0) {
      ++valid;
      hidden = hidden && depth[c] < landmark_depth_m - tolerance;
      through = through && depth[c] > landmark_depth_m + tolerance;
    }
  };
  look(cell);
  depth.for_each_around(cell, look);
  if (valid < kLeastAround) {
    return Visibility::Unclear;
  }
  return hidden ? Visibility::Hidden : through ? Visibility::Refuted : Visibility::Unclear;
}

}  // namespace

void judge_visibility(const MapSnapshot& map, const DynamicMask& mask, const Se3& T_map_camera, KeyframeRecord& record) {
  record.hidden.clear();
  record.refuted.clear();
  const Se3 T_camera_map = T_map_camera.inverse();
  const Eigen::Matrix3f R = T_camera_map.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_camera_map.translation().cast<float>();
  for (const SnapshotLandmark& landmark : map.landmarks) {  // ascending, and so are the results
    const Eigen::Vector3f p = R * landmark.p_map + t;
    const int cell = mask.camera().cell_of(p);
    if (cell == GridCamera::kOutside) {
      continue;
    }
    switch (judge(mask, static_cast<std::size_t>(cell), p.z())) {
      case Visibility::Hidden: record.hidden.push_back(landmark.id); break;
      case Visibility::Refuted: record.refuted.push_back(landmark.id); break;
      case Visibility::Unclear: break;
    }
  }
}

void copy_static(const FeatureFrame& frame, std::span<const std::int32_t> landmark_of, const MapSnapshot& map,
                 const DynamicMask* mask, KeyframeRecord& record) {
  record.features.keypoints.clear();
  record.features.descriptors.clear();
  record.ideal_pixels.clear();
  record.depth_m.clear();
  record.landmarks.clear();
  record.hidden.clear();
  record.refuted.clear();
  record.shows_movers = mask != nullptr && mask->summary().masked_share > 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const Keypoint& keypoint = frame.features().keypoints[i];
    if (mask != nullptr && mask->is_mover(keypoint.x, keypoint.y, frame.depth_m()[i])) {
      continue;
    }
    record.features.keypoints.push_back(keypoint);
    record.features.descriptors.push_back(frame.features().descriptors[i]);
    record.ideal_pixels.push_back(frame.ideal_pixels()[i]);
    record.depth_m.push_back(frame.depth_m()[i]);
    const std::int32_t landmark = landmark_of[i];
    record.landmarks.push_back(landmark == kUnmatched ? kNoLandmark : map.landmarks[static_cast<std::size_t>(landmark)].id);
  }
}

}  // namespace posed
