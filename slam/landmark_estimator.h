#pragma once

#include <limits>

#include <Eigen/Core>

#include "config/config.h"
#include "core/pinhole_camera.h"
#include "slam/map.h"
#include "slam/map_snapshot.h"
#include "slam/measurement_noise.h"

namespace posed {

/// A keyframe's measurement of a landmark, linearised at the landmark's present position.
struct LandmarkMeasurement {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< of the landmark in the map frame, given the keyframe's pose [1 / m^2]
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< J^T W e: information^-1 times this is the measurement's correction [m]
  double chi2 = std::numeric_limits<double>::infinity();  ///< infinite behind the camera
  int dimensions = 0;                                     ///< 2, or 3 where the keypoint has depth
};

/// What keyframes say of a landmark: where it is, how sure that is, what it looks like, and from where it can be seen. Residuals
/// are those of pose_solver.h. Immutable, so thread-safe.
class LandmarkEstimator {
 public:
  LandmarkEstimator(const TrackerConfig& config, const CameraIntrinsics& camera);

  LandmarkMeasurement measure(const Landmark& landmark, const Keyframe& keyframe, std::uint16_t keypoint) const;

  /// Whether a measurement agrees with the landmark (99 % of good ones do).
  static bool agrees(const LandmarkMeasurement& measurement);

  /// Moves the landmark by a measurement, weighted by the information of both (an information filter's update).
  static void update(Landmark& landmark, const LandmarkMeasurement& measurement);

  /// Sums the information of all observations that agree, at the present poses.
  void renew_information(const Map& map, Landmark& landmark) const;

  /// Chooses the descriptor and renews viewing direction and range of distances.
  void renew_appearance(const Map& map, Landmark& landmark) const;

  /// Whether a camera at T_map_camera should see the landmark: inside the image, within range and not too oblique.
  bool in_view(const Landmark& landmark, const Se3& T_map_camera) const;

  const PinholeCamera& camera() const { return camera_; }
  const MeasurementNoise& noise() const { return noise_; }

 private:
  PinholeCamera camera_;
  MeasurementNoise noise_;
  float pyramid_scale_;
  int pyramid_levels_;
};

/// A landmark as the tracker and the matcher see it.
SnapshotLandmark to_snapshot(LandmarkId id, const Landmark& landmark);

}  // namespace posed
