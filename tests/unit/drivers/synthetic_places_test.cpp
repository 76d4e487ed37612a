#include "drivers/synthetic_places.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "drivers/synthetic_walk.h"
#include "drivers/synthetic_world.h"
#include "tests/unit/drivers/synthetic_studio.h"

namespace posed {
namespace {

SyntheticConfig empty_world(SyntheticWorldKind kind, std::int64_t seed = 1) {
  SyntheticConfig config;
  config.world = kind;
  config.people = 0;
  config.seed = seed;
  return config;
}

/// Frame nearest to `t_s`.
std::uint64_t frame_at(double t_s) {
  return static_cast<std::uint64_t>(std::llround(t_s * 30.0));
}

class WalkedWorld : public testing::TestWithParam<SyntheticWorldKind> {};

TEST_P(WalkedWorld, CameraWalksSmoothlyAndKeepsItsDistance) {
  constexpr double kStep_s = 0.01;
  for (const std::int64_t seed : {1, 2}) {
    const SyntheticWorld world(empty_world(GetParam(), seed));
    Se3 previous = world.camera_pose(0);
    Vector6d previous_twist = Vector6d::Zero();
    double slowest = 1e9;
    for (double t_s = kStep_s; t_s < world.trajectory().period_s() + 2; t_s += kStep_s) {
      const Se3 pose = world.camera_pose(t_s);
      ASSERT_GT(world.scene().clearance(pose.translation().cast<float>()), 0.3F) << "seed " << seed << ", at " << t_s << " s";
      const Vector6d twist = (previous.inverse() * pose).log() / kStep_s;
      ASSERT_LT(twist.tail<3>().norm(), WalkTrajectory::kMaxSpeed_m_s) << "seed " << seed << ", at " << t_s << " s";
      ASSERT_LT(twist.head<3>().norm(), WalkTrajectory::kMaxRate_rad_s) << "seed " << seed << ", at " << t_s << " s";
      // Accelerations below 3 m/s^2 and rad/s^2: no jump in the velocity.
      ASSERT_LT((twist - previous_twist).norm(), 3 * kStep_s) << "seed " << seed << ", at " << t_s << " s";
      slowest = t_s > WalkTrajectory::kRampUp_s ? std::min(slowest, twist.tail<3>().norm()) : slowest;
      previous = pose;
      previous_twist = twist;
    }
    EXPECT_GT(slowest, 0.5) << "seed " << seed;
  }
}

TEST_P(WalkedWorld, EveryRoundIsTheSame) {
  const SyntheticWorld world(empty_world(GetParam()));
  const double period_s = world.trajectory().period_s();
  for (const double t_s : {2.0, 11.3, 30.0}) {
    const Se3 round = world.camera_pose(t_s).inverse() * world.camera_pose(t_s + 100 * period_s);
    EXPECT_LT(round.log().norm(), 1e-7) << "at " << t_s;
  }
  // The first round takes longer by half of the time in which it gathers speed.
  const Se3 closure = world.camera_pose(0).inverse() * world.camera_pose(period_s + SyntheticTrajectory::kRampUp_s / 2);
  EXPECT_LT(closure.log().norm(), 1e-9);
}

TEST_P(WalkedWorld, PicturesAreClosedAndRichInTextureAllTheWay) {
  SyntheticConfig config = empty_world(GetParam());
  config.sensor_noise = false;
  Studio studio(config);
  const double period_s = studio.camera().world().trajectory().period_s();
  int sum = 0;
  int count = 0;
  for (double t_s = 0; t_s < period_s; t_s += 0.7) {
    const Picture picture = studio.take(frame_at(t_s));
    const auto [nearest, farthest] = std::minmax_element(picture.depth_m.begin(), picture.depth_m.end());
    ASSERT_GT(*nearest, 0.15F) << "at " << t_s << " s";  // 0 would be a slit in the walls
    ASSERT_LT(*farthest, 15.0F) << "at " << t_s << " s";
    const int rich = rich_cells(picture, small_camera());
    EXPECT_GE(rich, 7) << "of 12 cells, at " << t_s << " s";
    sum += rich;
    ++count;
  }
  EXPECT_GE(static_cast<double>(sum) / count, 9.5);
}

TEST_P(WalkedWorld, SameSeedSameBytes) {
  Studio one(empty_world(GetParam()));
  Studio two(empty_world(GetParam()));
  Studio other(empty_world(GetParam(), 2));
  two.take(frame_at(20));
  const Picture a = one.take(frame_at(13));
  const Picture b = two.take(frame_at(13));
  EXPECT_EQ(a.bgr, b.bgr);
  EXPECT_EQ(a.depth_m, b.depth_m);
  EXPECT_NE(a.bgr, other.take(frame_at(13)).bgr);
}

INSTANTIATE_TEST_SUITE_P(Worlds, WalkedWorld,
                         testing::Values(SyntheticWorldKind::Corridor, SyntheticWorldKind::Office, SyntheticWorldKind::TwinRooms),
                         [](const auto& world) {
                           const std::string name(world_name(world.param));
                           return name == "twin_rooms" ? std::string("twinrooms") : name;
                         });

TEST(Corridor, IsThirtyMetresRound) {
  const SyntheticWorld world(empty_world(SyntheticWorldKind::Corridor));
  const auto& walk = dynamic_cast<const WalkTrajectory&>(world.trajectory());
  EXPECT_NEAR(walk.path().length_m(), 30.0, 1e-9);
  EXPECT_NEAR(walk.period_s(), 45.0, 1e-9);
}

/// Where the way meets itself again, at least 3 m of way apart: metres of it that are within 5 cm and 3 degrees of another part of
/// the way, in the same direction or in the opposite one.
TEST(Office, WayMeetsItselfInBothDirections) {
  const SyntheticWorld world(empty_world(SyntheticWorldKind::Office));
  const RoundedPath path = dynamic_cast<const WalkTrajectory&>(world.trajectory()).path();
  EXPECT_GT(path.length_m(), 25.0);
  EXPECT_LT(path.length_m(), 30.0);
  constexpr double kStep_m = 0.05;
  int same = 0;
  int opposite = 0;
  for (double s = 0; s < path.length_m(); s += kStep_m) {
    bool meets_same = false;
    bool meets_opposite = false;
    for (double other = s + 3; other < s + path.length_m() - 3; other += kStep_m) {
      if ((path.point(s) - path.point(other)).norm() < 0.05) {
        const double along = std::cos(path.heading_rad(s) - path.heading_rad(other));
        meets_same = meets_same || along > 0.9986;
        meets_opposite = meets_opposite || along < -0.9986;
      }
    }
    same += meets_same ? 1 : 0;
    opposite += meets_opposite ? 1 : 0;
  }
  EXPECT_GT(same * kStep_m, 2.0);
  EXPECT_GT(opposite * kStep_m, 3.0);
}

double mean_difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.gray.size(); ++i) {
    sum += std::abs(static_cast<int>(a.gray[i]) - static_cast<int>(b.gray[i]));
  }
  return sum / static_cast<double>(a.gray.size());
}

/// Half a round on, the camera is in the other room, at the same place there: the pictures cannot be told apart, but where they
/// show the corridor.
TEST(TwinRooms, LookAlikeAndTheirCorridorDoesNot) {
  SyntheticConfig config = empty_world(SyntheticWorldKind::TwinRooms);
  config.sensor_noise = false;
  const double period_s = SyntheticWorld(config).trajectory().period_s();
  config.rate_hz = 200 / period_s;  // so that half a round is a whole number of frames
  Studio studio(config);
  const Se3 T_turn(Eigen::Quaterniond(0, 0, 0, 1), Eigen::Vector3d::Zero());
  int alike = 0;
  int different = 0;
  for (std::uint64_t index = 20; index < 120; index += 2) {
    const Picture here = studio.take(index);
    const Picture there = studio.take(index + 100);
    ASSERT_LT((there.T_world_camera.inverse() * T_turn * here.T_world_camera).log().norm(), 1e-9);
    const Eigen::Vector3d position = here.T_world_camera.translation();
    const Eigen::Vector3d view = here.T_world_camera.rotation() * Eigen::Vector3d::UnitZ();
    const double outwards = view.x() * (position.x() > 0 ? 1 : -1);  // away from the corridor's middle
    const bool in_corridor = std::abs(position.x()) < 2.0;
    if (!in_corridor && outwards > 0.62) {  // no ray of the picture goes back to the doorway
      EXPECT_LT(mean_difference(here, there), 0.1) << "frame " << index;
      ++alike;
    } else if (in_corridor && outwards < 0) {
      EXPECT_GT(mean_difference(here, there), 6.0) << "frame " << index;
      ++different;
    }
  }
  EXPECT_GE(alike, 10);
  EXPECT_GE(different, 5);
}

}  // namespace
}  // namespace posed
