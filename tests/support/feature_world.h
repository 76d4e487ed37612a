#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "config/config.h"
#include "core/pinhole_camera.h"
#include "core/se3.h"
#include "slam/descriptor.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_record.h"

namespace posed {

/// Random points, each with a descriptor of its own, seen by a camera without distortion: what the extractor would give of a
/// perfect world, for tests of what comes after it. Index i of a view is point `seen[i]`.
class FeatureWorld {
 public:
  struct View {
    Se3 T_map_camera;
    Features features;
    std::vector<Eigen::Vector2f> ideal_pixels;
    std::vector<float> depth_m;
    std::vector<std::size_t> seen;
    std::vector<float> depth_image;
  };

  explicit FeatureWorld(unsigned seed, int points = 1500) : generator_(seed) {
    std::uniform_real_distribution<double> xy(-3, 3);
    std::uniform_real_distribution<double> z(1.5, 4.0);
    for (int i = 0; i < points; ++i) {
      points_.emplace_back(xy(generator_), 0.7 * xy(generator_), z(generator_));
      descriptors_.push_back(random_descriptor());
    }
  }

  /// A world of the given points.
  FeatureWorld(unsigned seed, std::vector<Eigen::Vector3d> points) : generator_(seed), points_(std::move(points)) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      descriptors_.push_back(random_descriptor());
    }
  }

  /// Once more all that is there, displaced: places that look the same.
  void repeat(const Eigen::Vector3d& displacement) {
    const std::size_t count = points_.size();
    for (std::size_t i = 0; i < count; ++i) {
      points_.push_back(points_[i] + displacement);
      descriptors_.push_back(descriptors_[i]);
    }
  }

  /// Another point, which looks like no other.
  void add(const Eigen::Vector3d& point) {
    points_.push_back(point);
    descriptors_.push_back(random_descriptor());
  }

  /// Features from `T_map_camera`: pixel noise of `pixel_sigma`, depth noise of `depth_sigma_m`, `flips` random bits of each
  /// descriptor.
  View view(const Se3& T_map_camera, double pixel_sigma = 0, double depth_sigma_m = 0, int flips = 10) {
    View v;
    v.T_map_camera = T_map_camera;
    v.depth_image.assign(static_cast<std::size_t>(intrinsics.width * intrinsics.height), 0.0F);
    const PinholeCamera camera(intrinsics);
    std::normal_distribution<double> normal;
    const Se3 T_camera_map = T_map_camera.inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d p = T_camera_map * points_[i];
      if (p.z() < 0.3 || p.z() > range_m) {
        continue;
      }
      const Eigen::Vector2d pixel = camera.project(p) + pixel_sigma * Eigen::Vector2d(normal(generator_), normal(generator_));
      if (pixel.x() < 5 || pixel.y() < 5 || pixel.x() > intrinsics.width - 6 || pixel.y() > intrinsics.height - 6) {
        continue;
      }
      const auto z = static_cast<float>(p.z() + depth_sigma_m * normal(generator_));
      Keypoint k;
      k.x = static_cast<float>(pixel.x());
      k.y = static_cast<float>(pixel.y());
      k.level =
          static_cast<std::uint8_t>(std::clamp(static_cast<int>(std::lround(std::log(6.0 / p.norm()) / std::log(1.2))), 0, 7));
      Descriptor d = descriptors_[i];
      for (int f = 0; f < flips; ++f) {
        const std::uint64_t bit = generator_() % 256;
        d[bit / 64] ^= 1ULL << (bit % 64);
      }
      v.features.keypoints.push_back(k);
      v.features.descriptors.push_back(d);
      v.ideal_pixels.push_back(pixel.cast<float>());
      v.depth_m.push_back(z);
      v.seen.push_back(i);
      v.depth_image[static_cast<std::size_t>(std::lround(pixel.y()) * intrinsics.width + std::lround(pixel.x()))] = z;
    }
    return v;
  }

  /// The view as a keyframe record; `landmark_of_point` maps points to landmark ids where they are known (kNoLandmark elsewhere).
  static KeyframeRecord record(const View& view, KeyframeId id, const std::vector<LandmarkId>& landmark_of_point) {
    KeyframeRecord r;
    r.id = id;
    r.T_map_camera = view.T_map_camera;
    r.features = view.features;
    r.ideal_pixels = view.ideal_pixels;
    r.depth_m = view.depth_m;
    r.map_id = 1;
    r.starts_map = id == 1;
    for (const std::size_t point : view.seen) {
      r.landmarks.push_back(landmark_of_point.empty() ? kNoLandmark : landmark_of_point[point]);
    }
    return r;
  }

  FeatureFrame frame(const View& view) const {
    FeatureFrame f(PinholeCamera(intrinsics), 2 * points_.size());
    f.features() = view.features;
    f.place(PinholeCamera(intrinsics), {view.depth_image.data(), intrinsics.width, intrinsics.height, intrinsics.width, 1});
    return f;
  }

  const std::vector<Eigen::Vector3d>& points() const { return points_; }

  /// The point whose descriptor is nearest: which point a landmark stands for.
  std::size_t point_of(const Descriptor& descriptor) const;

  CameraIntrinsics intrinsics;
  double range_m = 20;  ///< how far the camera sees, in place of walls

 private:
  Descriptor random_descriptor() { return {generator_(), generator_(), generator_(), generator_()}; }

  std::mt19937_64 generator_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
};

inline std::size_t FeatureWorld::point_of(const Descriptor& descriptor) const {
  const auto nearest = std::min_element(descriptors_.begin(), descriptors_.end(), [&](const Descriptor& a, const Descriptor& b) {
    return hamming_distance(a, descriptor) < hamming_distance(b, descriptor);
  });
  return static_cast<std::size_t>(nearest - descriptors_.begin());
}

}  // namespace posed
