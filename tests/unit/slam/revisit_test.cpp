#include <cmath>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "tests/support/slam_rig.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

// The view sweeps by 6 degrees a second, and shows 62: frame 0 to kMapped is a fifth of the room.
constexpr std::uint64_t kMapped = 150;
constexpr std::uint64_t kStride = 2;  // every second frame is enough to map with
constexpr std::uint64_t kUnmapped = 600;
constexpr int kInTime = 15;
constexpr int kPatience = 15;  // frames without a pose before a new map is begun

/// A mapped part of the room, and a camera that is lost and found in it.
struct Revisit : testing::Test {
  TemporaryFolder folder;
  SlamRig rig{[] {
    Config config = rig_config();
    config.tracker.new_map_after_s = (kPatience - 0.5) / config.source.synthetic.rate_hz;
    return config;
  }()};
  SlamRig::SavedMap saved;

  void SetUp() override {
    for (std::uint64_t i = 0; i <= kMapped; i += kStride) {
      ASSERT_TRUE(rig.track(i).has_pose()) << i;
    }
    saved = rig.save(folder / "map");
  }

  bool is_right(std::uint64_t index, const PoseEstimate& estimate) const {
    const Se3 truth = rig.place_in(saved, rig.true_pose(index));
    return distance_between_m(truth, estimate.T_map_camera()) < 0.1 &&
           angle_between_rad(truth, estimate.T_map_camera()) < 5 * std::numbers::pi / 180;
  }

  /// Follows the way from `index` until there is a pose, which must come in time and be right, in the map that was there.
  void expect_found_from(std::uint64_t index) {
    for (int i = 0; i < kInTime; ++i, ++index) {
      const PoseEstimate estimate = rig.track(index);
      if (estimate.has_pose()) {
        EXPECT_TRUE(is_right(index, estimate));
        EXPECT_EQ(estimate.map_id, 1U);
        return;
      }
    }
    ADD_FAILURE() << "not found";
  }

  /// Follows the way, where nothing is mapped, until a new map begins there; gives the first index after that.
  std::uint64_t begin_new_map() {
    for (std::uint64_t i = 0; i < kPatience - 1; ++i) {
      EXPECT_FALSE(rig.track(kUnmapped + i).has_pose()) << i;
    }
    std::uint64_t i = kUnmapped + kPatience - 1;
    for (PoseEstimate estimate; !estimate.has_pose() && i < kUnmapped + 2 * kPatience; ++i) {
      estimate = rig.track(i);
    }
    return i;
  }
};

TEST_F(Revisit, FindsTheCameraAfterItWasCoveredAndWentOn) {
  rig.restart(saved);
  std::uint64_t i = 30;
  for (int tracked = 0; tracked < 10 && i < 60; ++i) {
    tracked += rig.track(i).has_pose() ? 1 : 0;
  }
  for (const std::uint64_t until = i + 60; i < until; ++i) {
    EXPECT_FALSE(rig.track(i, cover_camera).has_pose());
  }
  expect_found_from(i);
}

TEST_F(Revisit, FindsTheCameraThatWasCarriedToAnotherMappedPlace) {
  EXPECT_TRUE(rig.track(kMapped + 1).has_pose());
  expect_found_from(5);
}

TEST_F(Revisit, FindsTheCameraInALoadedMap) {
  rig.restart(saved);
  rig.hold_beside(Se3::exp((Vector6d() << 0.05, -0.1, 0.05, 0.1, -0.05, 0.1).finished()));
  expect_found_from(kMapped / 2);
}

TEST_F(Revisit, KeepsALoadedMapThatTheCameraIsNotIn) {
  rig.restart(saved);
  for (std::uint64_t i = 0; i < kPatience; ++i) {
    const PoseEstimate estimate = rig.track(kUnmapped + i);
    EXPECT_FALSE(estimate.has_pose()) << "no new map before its time";
    EXPECT_EQ(estimate.state, TrackingState::Relocalizing);
  }
  expect_found_from(kMapped / 2);
}

TEST_F(Revisit, TwoMapsBecomeOneWhereTheyMeet) {
  std::uint64_t index = begin_new_map();
  PoseEstimate estimate = rig.track(index);
  ASSERT_TRUE(estimate.has_pose());
  ASSERT_EQ(estimate.map_id, 2U);
  ASSERT_EQ(rig.snapshot().map_id, 2U);
  for (; index > kMapped / 2; index -= 3) {
    const Se3 T_odom_before = estimate.T_odom_camera;
    const std::uint64_t joined_before = rig.mapper().counters().maps_joined;
    estimate = rig.track(index - 3);
    ASSERT_TRUE(estimate.has_pose()) << index;
    const Se3 step = rig.true_pose(index).inverse() * rig.true_pose(index - 3);
    ASSERT_LT(distance_between_m(T_odom_before.inverse() * estimate.T_odom_camera, step), 0.03)
        << "odom goes on as the camera does, at " << index;
    if (joined_before == 1) {
      EXPECT_EQ(estimate.map_id, 1U);
    }
  }
  EXPECT_EQ(rig.mapper().counters().maps_joined, 1U);
  EXPECT_TRUE(is_right(index, estimate));
}

TEST_F(Revisit, ComesBackToTheOldMapFromANewOne) {
  const std::uint64_t index = begin_new_map();
  EXPECT_EQ(rig.track(index).map_id, 2U);
  expect_found_from(kMapped / 2);
}

}  // namespace
}  // namespace posed
