#include "drivers/synthetic_world.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(SweepTrajectory, IsSmoothAndSlow) {
  constexpr double kStep_s = 0.01;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const SweepTrajectory trajectory(seed);
    Se3 previous = trajectory.pose(0);
    Vector6d previous_twist = Vector6d::Zero();
    double fastest = 0;
    for (int i = 1; i < 7000; ++i) {
      const Se3 pose = trajectory.pose(i * kStep_s);
      const Vector6d twist = (previous.inverse() * pose).log() / kStep_s;
      ASSERT_LT(twist.tail<3>().norm(), SweepTrajectory::kMaxSpeed_m_s) << "seed " << seed << ", step " << i;
      ASSERT_LT(twist.head<3>().norm(), SweepTrajectory::kMaxRate_rad_s) << "seed " << seed << ", step " << i;
      // Acceleration below 1.5 m/s^2 and rad/s^2: no jump in the velocity.
      ASSERT_LT((twist - previous_twist).norm(), 1.5 * kStep_s) << "seed " << seed << ", step " << i;
      fastest = std::max(fastest, twist.tail<3>().norm());
      previous = pose;
      previous_twist = twist;
    }
    EXPECT_GT(fastest, 0.15) << "seed " << seed;
  }
}

TEST(SweepTrajectory, StartsGentlyAndCloses) {
  const SweepTrajectory trajectory(3);
  const Se3 first_second = trajectory.pose(0).inverse() * trajectory.pose(1.0);
  EXPECT_LT(first_second.translation().norm(), 0.1);
  EXPECT_LT(first_second.log().head<3>().norm(), 0.15);
  for (const double t_s : {2.0, 17.3, 44.0}) {
    const Se3 round = trajectory.pose(t_s).inverse() * trajectory.pose(t_s + 1000 * SweepTrajectory::kPeriod_s);
    EXPECT_LT(round.log().norm(), 1e-7) << "no drift over a thousand rounds, at " << t_s;
  }
}

class SyntheticRoom : public testing::TestWithParam<SyntheticMode> {};

TEST_P(SyntheticRoom, CameraKeepsItsDistance) {
  SyntheticConfig config;
  config.mode = GetParam();
  const SyntheticWorld world(config);
  std::vector<BodyPart> bodies;
  for (double t_s = 0; t_s < 62; t_s += 0.1) {
    const Eigen::Vector3f eye = world.camera_pose(t_s).translation().cast<float>();
    ASSERT_GT(world.scene().clearance(eye), 0.6F) << "at " << t_s << " s";
    world.body_parts(t_s, bodies);
    ASSERT_EQ(bodies.size(), static_cast<std::size_t>(config.people * SyntheticPerson::kParts));
    for (const BodyPart& part : bodies) {
      const Eigen::Vector3f middle = (part.base + part.tip()) / 2;
      ASSERT_GT((middle - eye).norm() - part.length_m / 2 - part.bounding_radius_m(), 0.2F) << "a body at " << t_s << " s";
    }
  }
}

TEST_P(SyntheticRoom, PeopleMoveAsPeopleDo) {
  SyntheticConfig config;
  config.mode = GetParam();
  config.people = 3;
  const SyntheticWorld world(config);
  constexpr double kStep_s = 0.02;
  std::vector<BodyPart> now;
  std::vector<BodyPart> before;
  world.body_parts(0, before);
  float farthest = 0;
  std::vector<BodyPart> start = before;
  for (int i = 1; i < 3200; ++i) {  // over the end of a round
    world.body_parts(i * kStep_s, now);
    for (std::size_t k = 0; k < now.size(); ++k) {
      ASSERT_LT((now[k].base - before[k].base).norm(), 4.5F * static_cast<float>(kStep_s)) << "part " << k << ", step " << i;
      ASSERT_GT(now[k].base.z(), 0.0F);
      farthest = std::max(farthest, (now[k].base - start[k].base).norm());
      if (k % SyntheticPerson::kParts == 0) {  // the hips stay clear of walls and of what stands there
        ASSERT_LT(std::abs(now[k].base.x()), world.scene().shell.half_m.x() - 0.5F);
        ASSERT_LT(std::abs(now[k].base.y()), world.scene().shell.half_m.y() - 0.5F);
      }
    }
    before = now;
  }
  if (GetParam() == SyntheticMode::Walking) {
    EXPECT_GT(farthest, 1.5F);
  } else {
    EXPECT_GT(farthest, 0.1F);
    EXPECT_LT(farthest, 0.8F);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, SyntheticRoom, testing::Values(SyntheticMode::Sitting, SyntheticMode::Walking),
                         [](const auto& mode) { return mode.param == SyntheticMode::Sitting ? "Sitting" : "Walking"; });

}  // namespace
}  // namespace posed
