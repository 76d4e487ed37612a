#include "core/pinhole_camera.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/freiburg1_camera.h"

namespace posed {
namespace {

TEST(PinholeCamera, ProjectsAPointOnTheAxisToThePrincipalPoint) {
  const PinholeCamera camera{CameraIntrinsics{}};
  EXPECT_EQ(camera.project({0, 0, 2}), Eigen::Vector2d(319.5, 239.5));
  // 525 px focal length: 1 m to the right at 5.25 m is 100 px; y points down, as rows do.
  EXPECT_LT((camera.project({1, 0.5, 5.25}) - Eigen::Vector2d(419.5, 289.5)).norm(), 1e-12);
}

TEST(PinholeCamera, UnprojectUndoesProject) {
  const PinholeCamera camera(freiburg1_camera());
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, -0.2, 1.0), Eigen::Vector3d(-2, 1, 4), Eigen::Vector3d(0.01, 0.02, 0.4)}) {
    EXPECT_LT((camera.unproject(camera.project(p), p.z()) - p).norm(), 1e-14);
  }
}

TEST(PinholeCamera, WithoutCoefficientsDistortionIsTheIdentity) {
  const PinholeCamera camera{CameraIntrinsics{}};
  EXPECT_FALSE(camera.is_distorted());
  const Eigen::Vector2d pixel(17.25, 401.5);
  EXPECT_EQ(camera.distort(pixel), pixel);
  EXPECT_EQ(camera.undistort(pixel), pixel);
  EXPECT_EQ(camera.undistorted_bounds(), Eigen::Vector4d(0, 0, 639, 479));
}

TEST(PinholeCamera, AnyCoefficientMakesItDistorted) {
  for (double CameraIntrinsics::*coefficient :
       {&CameraIntrinsics::k1, &CameraIntrinsics::k2, &CameraIntrinsics::p1, &CameraIntrinsics::p2, &CameraIntrinsics::k3}) {
    CameraIntrinsics k;
    k.*coefficient = 1e-3;
    const PinholeCamera camera(k);
    EXPECT_TRUE(camera.is_distorted());
    EXPECT_NE(camera.distort({600, 30}), Eigen::Vector2d(600, 30));
  }
}

TEST(PinholeCamera, DistortsAsTheBrownConradyModelSays) {
  // Worked by hand at the normalised point (0.5, -0.25), r^2 = 0.3125, one coefficient at a time.
  CameraIntrinsics k;
  k.fx = k.fy = 100;
  k.cx = k.cy = 0;
  const Eigen::Vector2d ideal(50, -25);
  const auto distorted = [&](double CameraIntrinsics::*coefficient) {
    CameraIntrinsics one = k;
    one.*coefficient = 0.1;
    return PinholeCamera(one).distort(ideal);
  };
  EXPECT_LT((distorted(&CameraIntrinsics::k1) - ideal * 1.03125).norm(), 1e-12);
  EXPECT_LT((distorted(&CameraIntrinsics::k2) - ideal * 1.009765625).norm(), 1e-12);
  EXPECT_LT((distorted(&CameraIntrinsics::k3) - ideal * 1.0030517578125).norm(), 1e-12);
  // p1: dx = 2 p1 x y, dy = p1 (r^2 + 2 y^2); p2: dx = p2 (r^2 + 2 x^2), dy = 2 p2 x y.
  EXPECT_LT((distorted(&CameraIntrinsics::p1) - (ideal + Eigen::Vector2d(-2.5, 4.375))).norm(), 1e-12);
  EXPECT_LT((distorted(&CameraIntrinsics::p2) - (ideal + Eigen::Vector2d(8.125, -2.5))).norm(), 1e-12);
}

TEST(PinholeCamera, UndistortInvertsAStrongLensOverTheWholeImage) {
  const PinholeCamera camera(freiburg1_camera());
  double worst = 0;
  double largest_shift = 0;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const Eigen::Vector2d seen(x, y);
      const Eigen::Vector2d ideal = camera.undistort(seen);
      worst = std::max(worst, (camera.distort(ideal) - seen).norm());
      largest_shift = std::max(largest_shift, (ideal - seen).norm());
    }
  }
  EXPECT_LT(worst, 1e-6);
  EXPECT_GT(largest_shift, 10.0);  // otherwise this lens tests nothing
}

TEST(PinholeCamera, DistortionGrowsOutwardsWithoutFoldingBack) {
  // The inverse is unique only while pixels further out stay further out: check it along rays from the centre to every border
  // pixel.
  const PinholeCamera camera(freiburg1_camera());
  const Eigen::Vector2d centre(camera.intrinsics().cx, camera.intrinsics().cy);
  for (int x = 0; x < 640; x += 3) {
    for (const int y : {0, 479}) {
      double last = -1;
      for (double t = 0; t <= 1.0; t += 0.01) {
        const double radius = (camera.undistort(centre + t * (Eigen::Vector2d(x, y) - centre)) - centre).norm();
        ASSERT_GT(radius, last) << "towards " << x << ", " << y;
        last = radius;
      }
    }
  }
}

TEST(PinholeCamera, BoundsHoldEveryUndistortedPixelTightly) {
  for (const double k1 : {-0.15, 0.1}) {  // barrel (sides bulge beyond the corners' box) and pincushion
    CameraIntrinsics k;
    k.k1 = k1;
    const PinholeCamera camera(k);
    const Eigen::Vector4d bounds = camera.undistorted_bounds();
    Eigen::Vector4d exact(1e9, 1e9, -1e9, -1e9);
    for (int y = 0; y < k.height; ++y) {
      for (int x = 0; x < k.width; ++x) {
        const Eigen::Vector2d u = camera.undistort(Eigen::Vector2d(x, y));
        exact.head<2>() = exact.head<2>().cwiseMin(u);
        exact.tail<2>() = exact.tail<2>().cwiseMax(u);
      }
    }
    EXPECT_LT((bounds - exact).cwiseAbs().maxCoeff(), 1e-9) << "k1 " << k1;
  }
}

}  // namespace
}  // namespace posed
