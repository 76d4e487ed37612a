#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/pinhole_camera.h"
#include "slam/bundle_problem.h"

namespace posed {

/// A camera that goes round a corridor of points on its outer wall, looking outwards and slightly ahead. Neighbouring poses see
/// common points; where the walk is more than once round, later poses see points of the first round again.
struct BundleSceneOptions {
  int cameras = 10;
  int fixed_cameras = 1;  ///< the first ones
  int points = 400;
  double rounds = 0.25;  ///< of the walk
  double radius_m = 4.0;
  int observations_per_point = 1000;  ///< at most
  double pixel_sigma = 1.0;           ///< [pixels]
  double disparity_sigma = 0.3;       ///< [pixels]
  double depth_share = 0.8;           ///< of the observations that have depth
  double outlier_share = 0.0;
  double pose_error = 0.02;   ///< [rad, m] standard deviation of the start's
  double point_error = 0.05;  ///< [m]
  unsigned seed = 1;
};

struct BundleScene {
  BundleProblem problem;  ///< perturbed
  BundleProblem truth;    ///< the same, with the true poses and points
  std::vector<bool> is_outlier;
};

inline Se3 bundle_scene_pose(const BundleSceneOptions& options, int camera) {
  const double angle = 2.0 * std::numbers::pi * options.rounds * camera / options.cameras;
  // The camera's z axis along the radius, y down (map: z up).
  Eigen::Matrix3d R_map_camera;
  R_map_camera.col(2) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
  R_map_camera.col(1) = Eigen::Vector3d(0, 0, -1);
  R_map_camera.col(0) = R_map_camera.col(1).cross(R_map_camera.col(2));
  const double height = 0.2 * std::sin(5.0 * angle);
  const double radius = options.radius_m * (1.0 + 0.1 * std::sin(3.0 * angle));
  return Se3(Eigen::Quaterniond(R_map_camera), radius * R_map_camera.col(2) + Eigen::Vector3d(0, 0, height));
}

inline BundleScene make_bundle_scene(const PinholeCamera& camera, const BundleSceneOptions& options) {
  std::mt19937 generator(options.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const CameraIntrinsics& k = camera.intrinsics();
  const auto normal_vector = [&](double sigma) {
    const double x = sigma * normal(generator);
    const double y = sigma * normal(generator);
    return Eigen::Vector3d(x, y, sigma * normal(generator));
  };

  BundleScene scene;
  for (int c = 0; c < options.cameras; ++c) {
    scene.truth.cameras.push_back({bundle_scene_pose(options, c), c < options.fixed_cameras});
  }
  const double end_angle = 2.0 * std::numbers::pi * std::min(1.0, options.rounds * (options.cameras - 1) / options.cameras);
  for (int p = 0; p < options.points; ++p) {
    const double angle = end_angle * uniform(generator);
    const double distance = options.radius_m + 1.0 + 2.5 * uniform(generator);
    const double height = -1.0 + 2.0 * uniform(generator);
    const Eigen::Vector3d p_map(distance * std::cos(angle), distance * std::sin(angle), height);
    const auto index = static_cast<std::uint32_t>(scene.truth.points.size());
    std::vector<BundleObservation> seen;
    for (std::uint32_t c = 0; c < scene.truth.cameras.size(); ++c) {
      const Eigen::Vector3d p_camera = scene.truth.cameras[c].T_map_camera.inverse() * p_map;
      if (p_camera.z() < 0.3) {
        continue;
      }
      const Eigen::Vector2d pixel = camera.project(p_camera);
      if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > k.width - 1 || pixel.y() > k.height - 1) {
        continue;
      }
      BundleObservation o;
      o.camera = c;
      o.point = index;
      o.ideal_pixel = pixel + normal_vector(options.pixel_sigma).head<2>();
      const double disparity = k.baseline_fx / p_camera.z() + options.disparity_sigma * normal(generator);
      o.disparity = uniform(generator) < options.depth_share ? disparity : 0.0;
      o.pixel_weight = options.pixel_sigma > 0 ? 1.0 / (options.pixel_sigma * options.pixel_sigma) : 1.0;
      o.disparity_weight = options.disparity_sigma > 0 ? 1.0 / (options.disparity_sigma * options.disparity_sigma) : 1.0;
      seen.push_back(o);
    }
    // Of many sightings, an evenly spread choice.
    const auto most = static_cast<std::size_t>(options.observations_per_point);
    if (seen.size() > most) {
      for (std::size_t n = 0; n < most; ++n) {
        seen[n] = seen[n * seen.size() / most];
      }
      seen.resize(most);
    }
    if (seen.size() < 2) {
      continue;
    }
    scene.truth.points.push_back({p_map});
    for (BundleObservation& o : seen) {
      const bool outlier = uniform(generator) < options.outlier_share;
      if (outlier) {
        const double direction = 2.0 * std::numbers::pi * uniform(generator);
        o.ideal_pixel += (30.0 + 60.0 * uniform(generator)) * Eigen::Vector2d(std::cos(direction), std::sin(direction));
      }
      scene.is_outlier.push_back(outlier);
      scene.truth.observations.push_back(o);
    }
  }
  scene.problem = scene.truth;
  for (BundleCamera& c : scene.problem.cameras) {
    Vector6d xi;
    xi << normal_vector(options.pose_error), normal_vector(options.pose_error);
    if (!c.fixed) {
      c.T_map_camera = c.T_map_camera * Se3::exp(xi);
    }
  }
  for (BundlePoint& p : scene.problem.points) {
    p.p_map += normal_vector(options.point_error);
  }
  return scene;
}

}  // namespace posed
