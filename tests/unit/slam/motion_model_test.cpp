#include "slam/motion_model.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr std::int64_t kFrame = kNsPerSecond / 30;

const Vector6d kStep = (Vector6d() << 0.01, -0.02, 0.005, 0.03, 0.01, -0.02).finished();

TEST(MotionModel, GoesOnAsBefore) {
  MotionModel motion;
  const Se3 first = Se3::exp((Vector6d() << 0.5, 0.1, 0.2, 1, 2, 3).finished());
  motion.observe(first, 0);
  motion.observe(first * Se3::exp(kStep), kFrame);
  const Vector6d error = (motion.predict(2 * kFrame).inverse() * first * Se3::exp(kStep) * Se3::exp(kStep)).log();
  EXPECT_LT(error.norm(), 1e-6);
}

TEST(MotionModel, ScalesWithTheTimeThatPassed) {
  MotionModel motion;
  motion.observe(Se3(), 0);
  motion.observe(Se3::exp(kStep), kFrame);
  const Se3 predicted = motion.predict(4 * kFrame);  // two frames were dropped
  EXPECT_LT((predicted.inverse() * Se3::exp(4.0 * kStep)).log().norm(), 1e-6);
}

TEST(MotionModel, SaysHowFarItMovesInATime) {
  MotionModel motion;
  EXPECT_LT(motion.motion_over(kFrame).log().norm(), 1e-12) << "not known to move";
  motion.observe(Se3(), 0);
  motion.observe(Se3::exp(kStep), kFrame);
  EXPECT_LT((motion.motion_over(kFrame / 2).inverse() * Se3::exp(0.5 * kStep)).log().norm(), 1e-9);
  EXPECT_LT((motion.motion_over(-kFrame) * Se3::exp(kStep)).log().norm(), 1e-9) << "where it was before";
}

TEST(MotionModel, StaysWhereItWasWithoutAVelocity) {
  MotionModel motion;
  const Se3 pose = Se3::exp(kStep);
  motion.observe(pose, 0);
  EXPECT_LT((motion.predict(kFrame).inverse() * pose).log().norm(), 1e-12);
}

TEST(MotionModel, DoesNotExtrapolateAnOldVelocityNorBackwards) {
  MotionModel motion;
  motion.observe(Se3(), 0);
  const Se3 last = Se3::exp(kStep);
  motion.observe(last, kFrame);
  EXPECT_LT((motion.predict(10 * kNsPerSecond).inverse() * last).log().norm(), 1e-12);
  EXPECT_LT((motion.predict(0).inverse() * last).log().norm(), 1e-12);
}

TEST(MotionModel, SurvivesRepeatedStamps) {
  MotionModel motion;
  motion.observe(Se3(), 0);
  motion.observe(Se3::exp(kStep), 0);
  EXPECT_TRUE(motion.predict(kFrame).is_finite());
}

TEST(MotionModel, ForgetsOnRestart) {
  MotionModel motion;
  motion.observe(Se3(), 0);
  motion.observe(Se3::exp(kStep), kFrame);
  motion.restart();
  const Se3 elsewhere = Se3::exp(10.0 * kStep);
  motion.observe(elsewhere, 2 * kFrame);
  EXPECT_LT((motion.predict(3 * kFrame).inverse() * elsewhere).log().norm(), 1e-12);
}

}  // namespace
}  // namespace posed
