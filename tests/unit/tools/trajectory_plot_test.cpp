#include "tools/posectl/trajectory_plot.h"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using testing::HasSubstr;
using testing::Not;

Trajectory circle(double z_scale) {
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    const double angle = 0.1 * i;
    trajectory.push_back(
        {i * std::int64_t{50'000'000}, Se3({1, 0, 0, 0}, {0.01 * angle, std::cos(angle), z_scale * std::sin(angle)})});
  }
  return trajectory;
}

TEST(TrajectoryPlot, DrawsThePlaneOfMostMotion) {
  const Trajectory truth = circle(1.0);
  const std::string svg = plot_trajectories(truth, *evaluate_trajectory(truth, truth, {}));
  EXPECT_THAT(svg, HasSubstr("axes y (right) and z (up)"));
  EXPECT_THAT(svg, HasSubstr("ATE RMSE 0.0000 m"));
  EXPECT_TRUE(svg.starts_with("<svg "));
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

TEST(TrajectoryPlot, HasNoInfinitiesWhereNothingMoves) {
  Trajectory still = circle(1.0);
  for (StampedPose& pose : still) {
    pose.T_world_camera = Se3();
  }
  const std::string svg = plot_trajectories(still, *evaluate_trajectory(still, still, {}));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace posed
