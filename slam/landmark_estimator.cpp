#include "slam/landmark_estimator.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "slam/descriptor.h"

namespace posed {

namespace {

constexpr double kMinDepth = 0.05;        // [m]
constexpr double kChi2TwoDof = 9.210;     // 99 %
constexpr double kChi2ThreeDof = 11.345;  // 99 %
constexpr double kMinViewCosine = 0.5;
constexpr std::size_t kDescriptorCandidates = 8;  // newest observations among which the descriptor is chosen

}  // namespace

LandmarkEstimator::LandmarkEstimator(const TrackerConfig& config, const CameraIntrinsics& camera)
    : camera_(camera),
      noise_(config, camera),
      pyramid_scale_(static_cast<float>(config.pyramid_scale)),
      pyramid_levels_(config.pyramid_levels) {}

LandmarkMeasurement LandmarkEstimator::measure(const Landmark& landmark, const Keyframe& keyframe, std::uint16_t keypoint) const {
  LandmarkMeasurement m;
  const Eigen::Matrix3d R_camera_map = keyframe.T_map_camera.rotation_matrix().transpose();
  const Eigen::Vector3d p = R_camera_map * (landmark.p_map - keyframe.T_map_camera.translation());
  if (p.z() < kMinDepth) {
    return m;
  }
  const CameraIntrinsics& k = camera_.intrinsics();
  const double inverse_z = 1.0 / p.z();
  const double z = keyframe.depth_m[keypoint];
  const int level = keyframe.features.keypoints[keypoint].level;
  Eigen::Matrix3d projection;
  projection << k.fx * inverse_z, 0, -k.fx * p.x() * inverse_z * inverse_z,  //
      0, k.fy * inverse_z, -k.fy * p.y() * inverse_z * inverse_z,            //
      0, 0, -k.baseline_fx * inverse_z * inverse_z;
  const Eigen::Matrix3d jacobian = projection * R_camera_map;
  const Eigen::Vector2d predicted = camera_.project(p);
  const Eigen::Vector2d pixel = keyframe.ideal_pixels[keypoint].cast<double>();
  const Eigen::Vector3d error(pixel.x() - predicted.x(), pixel.y() - predicted.y(),
                              z > 0 ? k.baseline_fx / z - k.baseline_fx * inverse_z : 0.0);
  const double w = noise_.pixel_weight(level);
  const Eigen::Vector3d weight(w, w, z > 0 ? noise_.disparity_weight(level, z) : 0.0);
  m.information = jacobian.transpose() * weight.asDiagonal() * jacobian;
  m.gradient = jacobian.transpose() * weight.cwiseProduct(error);
  m.chi2 = weight.dot(error.cwiseAbs2());
  m.dimensions = z > 0 ? 3 : 2;
  return m;
}

bool LandmarkEstimator::agrees(const LandmarkMeasurement& measurement) {
  return measurement.chi2 <= (measurement.dimensions == 3 ? kChi2ThreeDof : kChi2TwoDof);
}

void LandmarkEstimator::update(Landmark& landmark, const LandmarkMeasurement& measurement) {
  landmark.information += measurement.information;
  landmark.p_map += landmark.information.inverse() * measurement.gradient;
}

void LandmarkEstimator::renew_information(const Map& map, Landmark& landmark) const {
  landmark.information.setZero();
  for (const Observation& o : landmark.observations) {
    const LandmarkMeasurement m = measure(landmark, *map.find_keyframe(o.keyframe), o.keypoint);
    if (agrees(m)) {
      landmark.information += m.information;
    }
  }
}

void LandmarkEstimator::renew_appearance(const Map& map, Landmark& landmark) const {
  const auto& observations = landmark.observations;
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
  for (const Observation& o : observations) {
    view += (landmark.p_map - map.find_keyframe(o.keyframe)->T_map_camera.translation()).normalized();
  }
  landmark.mean_view_map = view.normalized();

  const Observation& newest = observations.back();
  const Keyframe& keyframe = *map.find_keyframe(newest.keyframe);
  const auto distance = static_cast<float>((landmark.p_map - keyframe.T_map_camera.translation()).norm());
  landmark.max_distance_m =
      distance * std::pow(pyramid_scale_, static_cast<float>(keyframe.features.keypoints[newest.keypoint].level));
  landmark.min_distance_m = landmark.max_distance_m / std::pow(pyramid_scale_, static_cast<float>(pyramid_levels_ - 1));

  // The descriptor with the least median distance to the others stands for them all.
  const std::size_t count = std::min(observations.size(), kDescriptorCandidates);
  const Descriptor* candidates[kDescriptorCandidates];
  for (std::size_t i = 0; i < count; ++i) {
    const Observation& o = observations[observations.size() - count + i];
    candidates[i] = &map.find_keyframe(o.keyframe)->features.descriptors[o.keypoint];
  }
  int least_median = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < count; ++i) {
    int distances[kDescriptorCandidates];
    for (std::size_t j = 0; j < count; ++j) {
      distances[j] = hamming_distance(*candidates[i], *candidates[j]);
    }
    std::nth_element(distances, distances + count / 2, distances + count);
    if (distances[count / 2] < least_median) {
      least_median = distances[count / 2];
      landmark.descriptor = *candidates[i];
    }
  }
}

bool LandmarkEstimator::in_view(const Landmark& landmark, const Se3& T_map_camera) const {
  const Eigen::Vector3d p = T_map_camera.inverse() * landmark.p_map;
  if (p.z() < kMinDepth) {
    return false;
  }
  const Eigen::Vector2d pixel = camera_.project(p);
  const double distance = p.norm();
  const double view_cosine = (T_map_camera.rotation() * p).dot(landmark.mean_view_map) / distance;
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera_.intrinsics().width && pixel.y() < camera_.intrinsics().height &&
         distance < landmark.max_distance_m && distance > landmark.min_distance_m && view_cosine > kMinViewCosine;
}

SnapshotLandmark to_snapshot(LandmarkId id, const Landmark& landmark) {
  return {id,
          landmark.p_map.cast<float>(),
          landmark.mean_view_map.cast<float>(),
          landmark.max_distance_m,
          landmark.min_distance_m,
          landmark.descriptor,
          0};
}

}  // namespace posed
