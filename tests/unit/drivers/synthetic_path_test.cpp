#include "drivers/synthetic_path.h"

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadius_m = 0.5;

/// An L of six corners: five to the left, one to the right.
RoundedPath ell() {
  const std::array<Eigen::Vector2d, 6> corners{Eigen::Vector2d{4, 0}, {4, 2}, {2, 2}, {2, 4}, {0, 4}, {0, 0}};
  return RoundedPath(corners, kRadius_m);
}

TEST(RoundedPath, HasTheLengthOfItsLegsAndArcs) {
  EXPECT_NEAR(ell().length_m(), 16 - 6 * kRadius_m * (2 - kPi / 2), 1e-12);
  EXPECT_NEAR(ell().total_turn_rad(), 2 * kPi, 1e-12);
}

TEST(RoundedPath, BeginsOnTheLegToTheFirstCorner) {
  EXPECT_NEAR((ell().point(0) - Eigen::Vector2d(kRadius_m, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(ell().heading_rad(0), 0, 1e-12);
  EXPECT_NEAR((ell().point(3.0) - Eigen::Vector2d(3.5, 0)).norm(), 0, 1e-12);
  // Half of the arc at the first corner, whose centre is (3.5, 0.5).
  const Eigen::Vector2d half_way = ell().point(3.0 + kRadius_m * kPi / 4);
  EXPECT_NEAR((half_way - Eigen::Vector2d(3.5 + kRadius_m / std::numbers::sqrt2, 0.5 - kRadius_m / std::numbers::sqrt2)).norm(), 0,
              1e-12);
}

TEST(RoundedPath, GoesAlongItsHeadingAtUnitSpeedRoundAfterRound) {
  const RoundedPath path = ell();
  constexpr double kStep_m = 1e-3;
  for (double s = 0; s < 2.2 * path.length_m(); s += kStep_m) {
    const Eigen::Vector2d step = path.point(s + kStep_m) - path.point(s);
    const double heading = path.heading_rad(s + kStep_m / 2);
    ASSERT_NEAR((step - kStep_m * Eigen::Vector2d(std::cos(heading), std::sin(heading))).norm(), 0, 1e-6) << "at " << s;
    ASSERT_LE(std::abs(path.heading_rad(s + kStep_m) - path.heading_rad(s)), kStep_m / kRadius_m + 1e-9) << "at " << s;
  }
  for (const double s : {0.0, 3.3, 7.9, 12.1}) {
    EXPECT_NEAR((path.point(s + 3 * path.length_m()) - path.point(s)).norm(), 0, 1e-9);
    EXPECT_NEAR(path.heading_rad(s + 3 * path.length_m()), path.heading_rad(s) + 6 * kPi, 1e-9);
  }
}

TEST(RoundedPath, MeanHeadingIsTheMeanOfHeadings) {
  const RoundedPath path = ell();
  constexpr double kWindow_m = 1.4;
  constexpr int kSamples = 2000;
  for (double s = 0; s < 2 * path.length_m(); s += 0.37) {
    double sum = 0;
    for (int i = 0; i < kSamples; ++i) {
      sum += path.heading_rad(s + (i + 0.5) * kWindow_m / kSamples);
    }
    ASSERT_NEAR(path.mean_heading_rad(s, kWindow_m), sum / kSamples, 1e-6) << "at " << s;
  }
}

}  // namespace
}  // namespace posed
