#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "core/pinhole_camera.h"
#include "slam/map.h"
#include "slam/map_io.h"

namespace posed {

/// The header of the maps that `random_map` makes: a camera with distortion.
inline MapHeader random_map_header() {
  MapHeader header;
  header.camera.k1 = 0.1;
  header.camera.k2 = -0.05;
  header.camera.p1 = 0.001;
  header.pyramid_levels = 8;
  header.pyramid_scale = 1.2;
  header.active_map = 1;
  header.highest_map = 2;
  header.saved_utc_ns = 1'700'000'000'123'456'000;
  return header;
}

/// Keeps every rule of a map, but means nothing: keyframes of two maps, each with `keypoints` keypoints of which about half observe
/// a landmark, parents, and loops. The same seed makes the same map.
class RandomMap {
 public:
  RandomMap(std::uint32_t seed, int keyframes, int keypoints) : random_(seed), camera_(random_map_header().camera) {
    for (int k = 1; k <= keyframes; ++k) {
      add_keyframe(static_cast<KeyframeId>(k), static_cast<std::uint32_t>(k % 2), static_cast<std::size_t>(keypoints));
    }
    add_loops(static_cast<KeyframeId>(keyframes));
    map_.add_landmark({});  // observed by nobody: not saved
  }

  Map take() { return std::move(map_); }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::size_t index(std::size_t size) { return std::uniform_int_distribution<std::size_t>(0, size - 1)(random_); }

  template <typename Matrix>
  Matrix matrix() {
    return Matrix::NullaryExpr([this] { return uniform(-1, 1); });
  }

  Se3 pose() { return Se3::exp(matrix<Vector6d>() * 2); }

  Descriptor descriptor() {
    std::uniform_int_distribution<std::uint64_t> word;
    return {word(random_), word(random_), word(random_), word(random_)};
  }

  LandmarkId add_landmark() {
    Landmark landmark;
    landmark.p_map = matrix<Eigen::Vector3d>() * 5;
    landmark.information = matrix<Eigen::Matrix3d>();
    landmark.mean_view_map = matrix<Eigen::Vector3d>().normalized();
    landmark.max_distance_m = static_cast<float>(uniform(2, 9));
    landmark.min_distance_m = static_cast<float>(uniform(0.1, 2));
    landmark.descriptor = descriptor();
    landmark.predicted = 7;
    landmark.found = 3;
    return map_.add_landmark(landmark);
  }

  void add_keyframe(KeyframeId id, std::uint32_t map_id, std::size_t keypoints) {
    KeyframeRecord record;
    record.id = id;
    record.map_id = map_id;
    record.sequence = id * 10;
    record.capture_ns = static_cast<TimeNs>(id) * kNsPerSecond;
    record.T_map_camera = pose();
    record.covariance = matrix<Matrix6d>();
    for (std::size_t i = 0; i < keypoints; ++i) {
      const Keypoint keypoint{static_cast<float>(uniform(0, 639)), static_cast<float>(uniform(0, 479)),
                              static_cast<float>(uniform(-3, 3)), static_cast<std::uint8_t>(index(8)),
                              static_cast<std::uint8_t>(index(256))};
      record.features.keypoints.push_back(keypoint);
      record.features.descriptors.push_back(descriptor());
      record.ideal_pixels.emplace_back(camera_.undistort({keypoint.x, keypoint.y}).cast<float>());
      record.depth_m.push_back(index(4) == 0 ? 0.0F : static_cast<float>(uniform(0.5, 5)));
    }
    Keyframe& keyframe = map_.add_keyframe(record);
    keyframe.parent = id > 2 ? id - 2 : kNoKeyframe;  // of the same map
    std::vector<LandmarkId>& known = landmarks_[map_id];
    for (std::size_t i = 0; i < keypoints; ++i) {
      const std::size_t choice = index(4);
      if (choice == 0 || (choice == 1 && known.empty())) {
        known.push_back(add_landmark());
        map_.observe(known.back(), id, static_cast<std::uint16_t>(i));
      } else if (choice == 1) {
        const LandmarkId landmark = known[index(known.size())];
        if (Map::keypoint_of(*map_.find_landmark(landmark), id) < 0) {
          map_.observe(landmark, id, static_cast<std::uint16_t>(i));
        }
      }
    }
  }

  void add_loops(KeyframeId highest) {
    for (KeyframeId id = 5; id <= highest; id += 3) {
      map_.find_keyframe(id)->loops.push_back({id - 4, pose(), matrix<Matrix6d>()});
    }
  }

  std::mt19937 random_;
  PinholeCamera camera_;
  Map map_;
  std::vector<LandmarkId> landmarks_[2];
};

inline Map random_map(std::uint32_t seed, int keyframes, int keypoints) {
  return RandomMap(seed, keyframes, keypoints).take();
}

}  // namespace posed
