#include "slam/landmark_triangulation.h"

#include <cmath>

#include <Eigen/LU>

#include "slam/descriptor.h"

namespace posed {

namespace {

constexpr int kMaxDistance = 50;              // bits of 256
constexpr double kMaxRatio = 0.8;             // best over second best
constexpr double kChi2OneDof = 3.841;         // 95 %: distance from the epipolar line
constexpr double kLeastParallax_rad = 0.02;   // below, the depth of a triangulated point says little
constexpr double kLeastBaselineRatio = 0.01;  // of the baseline to the landmarks' distance, for a neighbour to be worth matching
constexpr double kTypicalDepth_m = 3.0;

Eigen::Matrix3d inverse_camera_matrix(const CameraIntrinsics& k) {
  Eigen::Matrix3d inverse;
  inverse << 1 / k.fx, 0, -k.cx / k.fx, 0, 1 / k.fy, -k.cy / k.fy, 0, 0, 1;
  return inverse;
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const PinholeCamera& camera, const Se3& T_map_a, const Eigen::Vector2d& pixel_a,
                                           const Se3& T_map_b, const Eigen::Vector2d& pixel_b, double least_parallax_rad) {
  const Eigen::Vector3d ray_a = (T_map_a.rotation() * camera.unproject(pixel_a, 1.0)).normalized();
  const Eigen::Vector3d ray_b = (T_map_b.rotation() * camera.unproject(pixel_b, 1.0)).normalized();
  if (ray_a.dot(ray_b) > std::cos(least_parallax_rad)) {
    return std::nullopt;
  }
  const Eigen::Matrix3d across_a = Eigen::Matrix3d::Identity() - ray_a * ray_a.transpose();
  const Eigen::Matrix3d across_b = Eigen::Matrix3d::Identity() - ray_b * ray_b.transpose();
  const Eigen::Vector3d p = (across_a + across_b).inverse() * (across_a * T_map_a.translation() + across_b * T_map_b.translation());
  if (ray_a.dot(p - T_map_a.translation()) <= 0 || ray_b.dot(p - T_map_b.translation()) <= 0) {
    return std::nullopt;
  }
  return p;
}

void LandmarkTriangulation::collect_free(const Keyframe& keyframe, std::vector<std::uint16_t>& free) const {
  free.clear();
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i] == kNoLandmark && (keyframe.depth_m[i] <= 0 || keyframe.depth_m[i] > close_depth_m_)) {
      free.push_back(static_cast<std::uint16_t>(i));
    }
  }
}

std::optional<LandmarkTriangulation::Match> LandmarkTriangulation::match_on_epipolar_line(
    const Keyframe& keyframe, std::uint16_t keypoint, const Keyframe& neighbour, const Eigen::Matrix3d& fundamental) const {
  const Eigen::Vector3d line = fundamental * keyframe.ideal_pixels[keypoint].cast<double>().homogeneous();
  const double norm2 = line.head<2>().squaredNorm();
  const int level = keyframe.features.keypoints[keypoint].level;
  Match best{0, kMaxDistance + 1};
  int second = 256;
  for (const std::uint16_t candidate : neighbour_free_) {
    const int candidate_level = neighbour.features.keypoints[candidate].level;
    const double off_line = line.dot(neighbour.ideal_pixels[candidate].cast<double>().homogeneous());
    if (std::abs(candidate_level - level) > 1 ||
        off_line * off_line * estimator_.noise().pixel_weight(candidate_level) > kChi2OneDof * norm2) {
      continue;
    }
    const int distance = hamming_distance(keyframe.features.descriptors[keypoint], neighbour.features.descriptors[candidate]);
    if (distance < best.distance) {
      second = best.distance;
      best = {candidate, distance};
    } else if (distance < second) {
      second = distance;
    }
  }
  return best.distance <= kMaxDistance && best.distance < kMaxRatio * second ? std::optional(best) : std::nullopt;
}

bool LandmarkTriangulation::make_landmark(Map& map, KeyframeId keyframe, std::uint16_t keypoint, KeyframeId neighbour,
                                          std::uint16_t neighbour_keypoint) {
  const Keyframe& a = *map.find_keyframe(keyframe);
  const Keyframe& b = *map.find_keyframe(neighbour);
  const auto p_map = triangulate(estimator_.camera(), a.T_map_camera, a.ideal_pixels[keypoint].cast<double>(), b.T_map_camera,
                                 b.ideal_pixels[neighbour_keypoint].cast<double>(), kLeastParallax_rad);
  if (!p_map) {
    return false;
  }
  Landmark landmark;
  landmark.p_map = *p_map;
  // A depth that is there must agree too: it is weighted for what it is worth.
  if (!LandmarkEstimator::agrees(estimator_.measure(landmark, a, keypoint)) ||
      !LandmarkEstimator::agrees(estimator_.measure(landmark, b, neighbour_keypoint))) {
    return false;
  }
  landmark.predicted = 2;
  landmark.found = 2;
  const LandmarkId id = map.add_landmark(std::move(landmark));
  map.observe(id, neighbour, neighbour_keypoint);
  map.observe(id, keyframe, keypoint);
  Landmark& made = *map.find_landmark(id);
  estimator_.renew_information(map, made);
  estimator_.renew_appearance(map, made);
  return true;
}

int LandmarkTriangulation::triangulate_between(Map& map, KeyframeId keyframe, KeyframeId neighbour) {
  const Keyframe& a = *map.find_keyframe(keyframe);
  const Keyframe& b = *map.find_keyframe(neighbour);
  const Se3 T_b_a = b.T_map_camera.inverse() * a.T_map_camera;
  if (T_b_a.translation().norm() < kLeastBaselineRatio * kTypicalDepth_m) {
    return 0;
  }
  const Eigen::Matrix3d inverse = inverse_camera_matrix(estimator_.camera().intrinsics());
  const Eigen::Matrix3d fundamental = inverse.transpose() * skew(T_b_a.translation()) * T_b_a.rotation_matrix() * inverse;
  collect_free(a, free_);
  collect_free(b, neighbour_free_);
  int made = 0;
  for (const std::uint16_t keypoint : free_) {
    const auto match = match_on_epipolar_line(a, keypoint, b, fundamental);
    if (match && b.landmarks[match->neighbour_keypoint] == kNoLandmark &&
        make_landmark(map, keyframe, keypoint, neighbour, match->neighbour_keypoint)) {
      ++made;
    }
  }
  return made;
}

}  // namespace posed
