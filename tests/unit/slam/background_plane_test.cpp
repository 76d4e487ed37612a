#include "slam/background_plane.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

const Eigen::Vector3f kNormal = Eigen::Vector3f(0.1F, 0.8F, 0.6F).normalized();
constexpr float kDistance_m = 0.9F;

/// Points seen in random directions: a share of them on the plane, but for some noise, the others anywhere between 0.5 and 4 m.
std::vector<Eigen::Vector3f> points(double share_on_plane, float noise_m, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> direction(-0.4F, 0.4F);
  std::uniform_real_distribution<float> depth(0.5F, 4.0F);
  std::normal_distribution<float> noise(0.0F, noise_m);
  std::vector<Eigen::Vector3f> all;
  constexpr int kPoints = 600;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3f ray(direction(random), direction(random), 1.0F);
    all.push_back(i < share_on_plane * kPoints ? Eigen::Vector3f(ray * (kDistance_m / kNormal.dot(ray)) + noise(random) * kNormal)
                                               : Eigen::Vector3f(ray * depth(random)));
  }
  std::shuffle(all.begin(), all.end(), random);
  return all;
}

TEST(BackgroundPlane, IsFoundAmongWhatDoesNotLieOnIt) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto plane = find_plane(points(0.5, 0.003F, seed), 0.4F);
    ASSERT_TRUE(plane) << seed;
    EXPECT_GT(std::abs(plane->normal.dot(kNormal)), 0.9998F) << seed;
    EXPECT_NEAR(std::abs(plane->distance_m), kDistance_m, 0.005F) << seed;
    EXPECT_NEAR(plane->normal.norm(), 1.0F, 1e-5F);
  }
}

TEST(BackgroundPlane, ThereIsNoneInPointsWithoutOrder) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(find_plane(points(0.0, 0.0F, seed), 0.2F)) << seed;
  }
}

TEST(BackgroundPlane, TheSamePointsGiveTheSamePlane) {
  const auto all = points(0.4, 0.005F, 3);
  const auto plane = find_plane(all, 0.2F);
  const auto again = find_plane(all, 0.2F);
  ASSERT_TRUE(plane && again);
  EXPECT_EQ(plane->normal, again->normal);
  EXPECT_EQ(plane->distance_m, again->distance_m);
}

TEST(BackgroundPlane, TwoPointsOrALineAreNone) {
  const std::vector<Eigen::Vector3f> two{{0, 0, 1}, {0, 1, 1}};
  EXPECT_FALSE(find_plane(two, 0.1F));
  EXPECT_FALSE(find_plane({}, 0.1F));
  std::vector<Eigen::Vector3f> line;
  for (int i = 0; i < 50; ++i) {
    line.emplace_back(0.01F * static_cast<float>(i), 0.02F * static_cast<float>(i), 1.0F);
  }
  EXPECT_FALSE(find_plane(line, 0.1F));
}

TEST(BackgroundPlane, HoldsWhatTheSensorMayBeOffBy) {
  const Plane plane{Eigen::Vector3f::UnitZ(), 1.0F};
  EXPECT_TRUE(plane.holds({0.3F, 0.1F, 1.01F}));
  EXPECT_FALSE(plane.holds({0.3F, 0.1F, 1.03F}));
  const Plane far{Eigen::Vector3f::UnitZ(), 3.0F};
  EXPECT_TRUE(far.holds({0, 0, 3.05F})) << "noise grows with the square of the depth";
  EXPECT_FALSE(far.holds({0, 0, 3.1F}));
}

}  // namespace
}  // namespace posed
