// What moves, from the image to the map: tracker and mapper together.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "slam/landmark_visibility.h"
#include "tests/support/slam_rig.h"

namespace posed {
namespace {

bool well_inside(ImageView<const std::uint8_t> mask, const Keypoint& keypoint) {
  constexpr int kMargin = 4;  // [pixels] at silhouettes a keypoint is the background's as much as the person's
  const int x = static_cast<int>(std::lround(keypoint.x));
  const int y = static_cast<int>(std::lround(keypoint.y));
  for (int v = std::max(0, y - kMargin); v <= std::min(mask.height - 1, y + kMargin); ++v) {
    for (int u = std::max(0, x - kMargin); u <= std::min(mask.width - 1, x + kMargin); ++u) {
      if (mask.row(v)[u] == 0) {
        return false;
      }
    }
  }
  return true;
}

std::size_t count_inside(ImageView<const std::uint8_t> mask, const std::vector<Keypoint>& keypoints) {
  return static_cast<std::size_t>(
      std::count_if(keypoints.begin(), keypoints.end(), [&](const Keypoint& k) { return well_inside(mask, k); }));
}

struct Walk {
  double rmse_m = 0;
  double share_on_person = 0;           ///< of the features that count for the pose, frames with a person
  double keyframe_share_on_person = 0;  ///< of those in keyframes
  int frames_with_person = 0;           ///< frames of which a person covers a twentieth or more
};

/// 150 frames of the room in which one person walks, seen by a detector without error in every third frame.
Walk walk(DynamicMode mode) {
  Config config = rig_config();
  config.source.synthetic.people = 1;
  config.dynamic.mode = mode;
  SlamRig rig(config);
  rig.detect_people_every(3);
  Walk result;
  double squared = 0;
  std::size_t kept = 0;
  std::size_t on_person = 0;
  std::size_t in_keyframes = 0;
  std::size_t in_keyframes_on_person = 0;
  constexpr std::uint64_t kFrames = 150;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const PoseEstimate estimate = rig.track(i);
    if (!estimate.has_pose()) {
      ADD_FAILURE() << "frame " << i << " has no pose";
      continue;
    }
    squared += std::pow(rig.error_m(i, estimate), 2);
    const ImageView<const std::uint8_t> mask = rig.person_mask();
    std::size_t covered = 0;
    for (int y = 0; y < mask.height; ++y) {
      covered += static_cast<std::size_t>(std::count_if(mask.row(y), mask.row(y) + mask.width, [](auto m) { return m != 0; }));
    }
    if (covered * 20 >= static_cast<std::size_t>(mask.width * mask.height)) {
      ++result.frames_with_person;
    }
    if (covered > 0) {
      const auto& keypoints = rig.tracker().last_features().features().keypoints;
      kept += keypoints.size();
      on_person += count_inside(mask, keypoints);
    }
    if (estimate.keyframe) {
      const auto& keypoints = rig.record().features.keypoints;
      in_keyframes += keypoints.size();
      in_keyframes_on_person += count_inside(mask, keypoints);
    }
  }
  result.rmse_m = std::sqrt(squared / kFrames);
  result.share_on_person = static_cast<double>(on_person) / static_cast<double>(std::max<std::size_t>(1, kept));
  result.keyframe_share_on_person =
      static_cast<double>(in_keyframes_on_person) / static_cast<double>(std::max<std::size_t>(1, in_keyframes));
  return result;
}

TEST(Movers, APersonWhoWalksIsInNeitherPoseNorMap) {
  const Walk full = walk(DynamicMode::Full);
  const Walk off = walk(DynamicMode::Off);
  EXPECT_GE(full.frames_with_person, 20);
  EXPECT_LT(full.rmse_m, 0.03);
  EXPECT_LT(full.share_on_person, 0.01);
  EXPECT_LT(full.keyframe_share_on_person, 0.005);
  // The same walk with everything taken for the room: the person matters.
  EXPECT_GT(off.share_on_person, 0.03);
  EXPECT_GT(off.rmse_m, 2 * full.rmse_m);
}

/// A poster of noise that stands upright across the first camera's view, and may be taken away.
struct Poster {
  static constexpr float kDistance_m = 1.2F;
  static constexpr float kHalf_m = 0.35F;

  static bool holds(const Eigen::Vector3f& p_map) {
    return std::abs(p_map.z() - kDistance_m) < 0.1F && std::abs(p_map.x()) < kHalf_m && std::abs(p_map.y()) < kHalf_m;
  }

  /// Puts it into the frame that a camera at `T_map_camera` sees.
  static void put_into(RgbdFrame& frame, const Se3& T_map_camera, const CameraIntrinsics& camera) {
    const Eigen::Matrix3f R = T_map_camera.rotation_matrix().cast<float>();
    const Eigen::Vector3f t = T_map_camera.translation().cast<float>();
    for (int y = 0; y < frame.gray.height; ++y) {
      for (int x = 0; x < frame.gray.width; ++x) {
        const Eigen::Vector3f ray((static_cast<float>(x) - static_cast<float>(camera.cx)) / static_cast<float>(camera.fx),
                                  (static_cast<float>(y) - static_cast<float>(camera.cy)) / static_cast<float>(camera.fy), 1.0F);
        const Eigen::Vector3f direction = R * ray;
        const float depth_m = (kDistance_m - t.z()) / direction.z();
        const Eigen::Vector3f p = t + depth_m * direction;
        if (depth_m > 0 && holds(p)) {
          frame.depth_m.row(y)[x] = depth_m;
          frame.gray.row(y)[x] = noise(p);
        }
      }
    }
  }

 private:
  static std::uint8_t noise(const Eigen::Vector3f& p) {
    constexpr float kPatch_m = 0.03F;
    auto hash = static_cast<std::uint32_t>(static_cast<int>(std::floor(p.x() / kPatch_m)) * 73856093) ^
                static_cast<std::uint32_t>(static_cast<int>(std::floor(p.y() / kPatch_m)) * 19349663);
    hash = (hash ^ (hash >> 13)) * 0x5bd1e995U;
    return static_cast<std::uint8_t>(hash >> 24);
  }
};

TEST(Movers, WhatIsTakenAwayLeavesTheMap) {
  SlamRig rig;
  const auto frame = [&](std::uint64_t i, bool with_poster) {
    const std::uint64_t index = i % 60 < 30 ? i % 60 : 60 - i % 60;  // to and fro
    const PoseEstimate estimate = rig.track(index, [&](RgbdFrame& seen) {
      if (with_poster) {
        Poster::put_into(seen, rig.true_pose_in_map(index), rig.config().intrinsics);
      }
    });
    EXPECT_TRUE(estimate.has_pose()) << i;
    EXPECT_LT(rig.error_m(index, estimate), 0.05) << i;
  };
  const auto landmarks_on_poster = [&] {
    const auto& landmarks = rig.snapshot().landmarks;
    return std::count_if(landmarks.begin(), landmarks.end(), [](const SnapshotLandmark& l) { return Poster::holds(l.p_map); });
  };
  std::uint64_t i = 0;
  for (; i < 60; ++i) {
    frame(i, true);
  }
  EXPECT_GT(landmarks_on_poster(), 200);
  for (; i < 150; ++i) {
    frame(i, false);
  }
  EXPECT_EQ(landmarks_on_poster(), 0);
}

TEST(Movers, DepthSaysWhichLandmarksAreHiddenAndWhichAreGone) {
  const CameraIntrinsics intrinsics;
  const PinholeCamera camera(intrinsics);
  std::vector<float> depth_m(static_cast<std::size_t>(intrinsics.width * intrinsics.height), 3.0F);
  for (int y = 0; y < intrinsics.height; ++y) {
    std::fill_n(depth_m.begin() + y * intrinsics.width, intrinsics.width / 4, 0.0F);  // no depth at the left
  }
  RgbdFrame frame;
  frame.depth_m = {depth_m.data(), intrinsics.width, intrinsics.height, intrinsics.width, 1};
  DynamicMask mask(DynamicConfig{}, camera);
  mask.begin(frame, Se3(), nullptr);
  mask.settle(Se3());

  MapSnapshot map;
  const auto add = [&](LandmarkId id, float x_pixels, float z_m) {
    SnapshotLandmark& landmark = map.landmarks.emplace_back();
    landmark.id = id;
    landmark.p_map = {(x_pixels - static_cast<float>(intrinsics.cx)) / static_cast<float>(intrinsics.fx) * z_m, 0.0F, z_m};
  };
  const float middle = static_cast<float>(intrinsics.width) / 2;
  add(1, middle, 2.0F);  // in front of the wall: the camera sees through it
  add(2, middle, 3.0F);  // on it
  add(3, middle, 4.0F);  // behind it
  add(4, 20.0F, 2.0F);   // where there is no depth
  add(5, middle, -2.0F);
  KeyframeRecord record;
  judge_visibility(map, mask, Se3(), record);
  EXPECT_EQ(record.refuted, std::vector<LandmarkId>{1});
  EXPECT_EQ(record.hidden, std::vector<LandmarkId>{3});
}

}  // namespace
}  // namespace posed
