#include "drivers/depth_registration.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/scalar_registration.h"

namespace posed::test {
namespace {

CameraIntrinsics camera(int width, int height, double focal) {
  CameraIntrinsics k;
  k.width = width;
  k.height = height;
  k.fx = focal;
  k.fy = 1.02 * focal;
  k.cx = 0.5 * width - 0.7;
  k.cy = 0.5 * height + 0.3;
  k.depth_units_per_metre = 1000.0;
  return k;
}

void distort(CameraIntrinsics& k) {
  k.k1 = 0.12;
  k.k2 = -0.21;
  k.p1 = 0.0011;
  k.p2 = -0.0007;
  k.k3 = 0.05;
}

Se3 turned(double x, double y, double z, double angle) {
  return Se3(exp_so3({0.3 * angle, -0.5 * angle, angle}), {x, y, z});
}

class Registration : public testing::Test {
 protected:
  void set(const CameraIntrinsics& depth, const CameraIntrinsics& color, const Se3& T_camera_depth) {
    depth_ = depth;
    color_ = color;
    T_ = T_camera_depth;
    raw_.assign(static_cast<std::size_t>(depth.width * depth.height), 0);
    // Every pixel must be written, and none beyond the image.
    out_.assign(static_cast<std::size_t>((color.width + kMargin) * color.height), kUnwritten);
  }

  template <typename Function>
  void paint(const Function& metres) {
    for (int y = 0; y < depth_.height; ++y) {
      for (int x = 0; x < depth_.width; ++x) {
        raw_[static_cast<std::size_t>(y * depth_.width + x)] = static_cast<std::uint16_t>(std::lround(1000.0 * metres(x, y)));
      }
    }
  }

  void paint_scene(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> noise(0.0, 1.0);
    paint([&](int x, int y) {
      const double wall = 2.0 + 0.01 * x + 0.3 * std::sin(0.2 * y);
      const double near = (x - 30) * (x - 30) + (y - 20) * (y - 20) < 90 ? 0.7 : wall;
      return noise(random) < 0.1 ? 0.0 : near + 0.02 * noise(random);
    });
  }

  ImageView<const std::uint16_t> raw() const { return {raw_.data(), depth_.width, depth_.height, depth_.width, 1}; }
  ImageView<float> view(std::vector<float>& pixels) const {
    return {pixels.data(), color_.width, color_.height, color_.width + kMargin, 1};
  }

  DepthRegistration apply() {
    DepthRegistration registration(depth_, color_, T_);
    registration.apply(raw(), view(out_));
    for (int y = 0; y < color_.height; ++y) {
      for (int x = 0; x < color_.width; ++x) {
        EXPECT_GE(at(x, y), 0.0F) << "not written: " << x << ", " << y;
      }
      EXPECT_EQ(view(out_).row(y)[color_.width], kUnwritten) << "row " << y;
    }
    return registration;
  }

  float at(int x, int y) { return view(out_).at(x, y); }

  std::size_t holes_within(int margin) {
    std::size_t holes = 0;
    for (int y = margin; y < color_.height - margin; ++y) {
      for (int x = margin; x < color_.width - margin; ++x) {
        holes += at(x, y) == 0.0F ? 1 : 0;
      }
    }
    return holes;
  }

  static constexpr int kMargin = 3;
  static constexpr float kUnwritten = -7.0F;

  CameraIntrinsics depth_;
  CameraIntrinsics color_;
  Se3 T_;
  std::vector<std::uint16_t> raw_;
  std::vector<float> out_;
};

TEST_F(Registration, OfACameraToItselfChangesNothing) {
  set(camera(70, 50, 60), camera(70, 50, 60), Se3());
  paint_scene(1);
  apply();
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 70; ++x) {
      ASSERT_NEAR(at(x, y), 0.001 * raw_[static_cast<std::size_t>(y * 70 + x)], 1e-6) << x << ", " << y;
    }
  }
}

TEST_F(Registration, EqualsTheScalarReferenceBitByBit) {
  for (const int width : {64, 65, 70, 127}) {
    for (const double scale : {0.6, 1.0, 1.37, 2.5}) {
      for (const bool lenses : {false, true}) {
        CameraIntrinsics depth = camera(width, 50, 60);
        CameraIntrinsics color = camera(static_cast<int>(scale * 70), static_cast<int>(scale * 50), scale * 60);
        if (lenses) {
          distort(depth);
          distort(color);
        }
        set(depth, color, turned(0.05, -0.02, 0.03, 0.1));
        paint_scene(static_cast<unsigned>(width));
        const DepthRegistration registration = apply();
        std::vector<float> reference(out_.size(), kUnwritten);
        ScalarRegistration(depth, color, T_, registration.half_patch()).apply(raw(), view(reference));
        ASSERT_EQ(out_, reference) << "width " << width << ", scale " << scale << ", distorted " << lenses;
      }
    }
  }
}

/// What a colour pixel must show: the nearest of all points whose patch, larger by `slack` pixels, holds the pixel's centre.
double brute_force(const CameraIntrinsics& depth, const CameraIntrinsics& color, const Se3& T, ImageView<const std::uint16_t> raw,
                   const Eigen::Vector2f& half_patch, double slack, int u, int v) {
  const PinholeCamera depth_lens(depth);
  const PinholeCamera color_lens(color);
  double nearest = 0;
  for (int y = 0; y < raw.height; ++y) {
    for (int x = 0; x < raw.width; ++x) {
      const double z = raw.at(x, y) / depth.depth_units_per_metre;
      if (z == 0) {
        continue;
      }
      const Eigen::Vector3d p = T * depth_lens.unproject(depth_lens.undistort({x, y}), z);
      const Eigen::Vector2d seen = color_lens.distort(color_lens.project(p));
      const double growth = z / p.z();
      if (std::abs(seen.x() - u) <= growth * half_patch.x() + slack && std::abs(seen.y() - v) <= growth * half_patch.y() + slack &&
          (nearest == 0 || p.z() < nearest)) {
        nearest = p.z();
      }
    }
  }
  return nearest;
}

TEST_F(Registration, EqualsBruteForceInDoublePrecision) {
  CameraIntrinsics depth = camera(40, 30, 36);
  CameraIntrinsics color = camera(52, 39, 47);
  distort(depth);
  distort(color);
  set(depth, color, turned(0.05, -0.02, 0.03, 0.1));
  paint_scene(5);
  const Eigen::Vector2f half_patch = apply().half_patch();
  int seen = 0;
  for (int v = 0; v < color.height; ++v) {
    for (int u = 0; u < color.width; ++u) {
      // At the very edge of a patch single precision may decide either way.
      const double larger = brute_force(depth, color, T_, raw(), half_patch, 1e-4, u, v);
      const double smaller = brute_force(depth, color, T_, raw(), half_patch, -1e-4, u, v);
      const double got = at(u, v);
      ASSERT_TRUE(std::abs(got - larger) < 1e-5 || std::abs(got - smaller) < 1e-5)
          << u << ", " << v << ": " << got << " where " << larger << " or " << smaller << " is right";
      seen += got > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(seen, 1000);
}

TEST_F(Registration, ShiftsByTheDisparity) {
  set(camera(70, 50, 60), camera(70, 50, 60), Se3(Eigen::Quaterniond::Identity(), {0.1, 0, 0}));
  paint([](int x, int) { return x == 20 ? 2.0 : 0.0; });
  apply();
  for (int x = 0; x < 70; ++x) {
    EXPECT_EQ(at(x, 25) > 0, x == 23) << x << ": 60 pixels * 0.1 m / 2 m = 3 pixels to the right";
  }
}

TEST_F(Registration, DepthIsAlongTheColourCamerasAxis) {
  set(camera(70, 50, 60), camera(70, 50, 60), Se3(Eigen::Quaterniond::Identity(), {0, 0, 0.25}));
  paint([](int, int) { return 2.0; });
  apply();
  EXPECT_NEAR(at(35, 25), 2.25, 1e-5);
}

TEST_F(Registration, TheNearestWins) {
  set(camera(70, 50, 60), camera(70, 50, 60), Se3(Eigen::Quaterniond::Identity(), {0.1, 0, 0}));
  paint([](int x, int) { return x >= 30 && x < 40 ? 1.0 : 3.0; });
  apply();
  // The near strip moves by 6 pixels, what is behind it by 2: it hides that, and leaves a shadow of 4 pixels behind.
  EXPECT_NEAR(at(40, 25), 1.0, 1e-5);
  EXPECT_NEAR(at(45, 25), 1.0, 1e-5);
  EXPECT_NEAR(at(46, 25), 3.0, 1e-5);
  EXPECT_EQ(at(34, 25), 0.0F);
  EXPECT_NEAR(at(31, 25), 3.0, 1e-5);
}

TEST_F(Registration, MagnificationLeavesNoHoles) {
  for (const double scale : {1.0, 1.3, 1.7, 2.0, 2.9}) {
    for (const bool slanted : {false, true}) {
      const CameraIntrinsics color = camera(static_cast<int>(60 * scale), static_cast<int>(40 * scale), scale * 60);
      // On the slanted wall neighbours lie a fifth further apart in the colour image than where it faces the camera.
      set(camera(150, 70, 60), color, turned(slanted ? -0.6 : 0.05, 0.01, 0, 0.005));
      paint([&](int x, int) { return slanted ? 2.0 / (1.0 - 0.6 * (x - 75) / 60.0) : 2.0; });
      apply();
      EXPECT_EQ(holes_within(2), 0U) << "scale " << scale << ", slanted " << slanted;
    }
  }
}

TEST_F(Registration, EdgesMoveByLessThanAPixel) {
  set(camera(70, 50, 60), camera(140, 100, 120), Se3());
  color_.cx = 2 * depth_.cx;
  color_.cy = 2 * depth_.cy;
  paint([](int x, int) { return x >= 30 && x < 40 ? 1.0 : 0.0; });
  apply();
  // Its pixels' centres go to 60, 62 ... 78, its edges to 59 and 79.
  for (int x = 0; x < 140; ++x) {
    EXPECT_EQ(at(x, 50) > 0, x >= 59 && x <= 79) << x;
  }
}

TEST_F(Registration, SurvivesWhatIsBehindTheCameraOrFarOutside) {
  CameraIntrinsics color = camera(70, 50, 60);
  distort(color);
  for (const Se3& T : {Se3(Eigen::Quaterniond::Identity(), {0, 0, -1.0}), turned(0, 0, -0.001, 3.0), turned(50, 0, 0, 0.0),
                       Se3(exp_so3({0, 1.5, 0}), {0.01, 0, 0}), Se3(exp_so3({3.1, 0, 0}), {0, 0, 0})}) {
    set(camera(70, 50, 60), color, T);
    for (std::size_t i = 0; i < raw_.size(); ++i) {
      raw_[i] = std::array<std::uint16_t, 4>{65535, 1, 900, 1005}[i % 4];
    }
    apply();
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 70; ++x) {
        ASSERT_TRUE(std::isfinite(at(x, y)) && (at(x, y) == 0.0F || at(x, y) > 0.01F)) << at(x, y);
      }
    }
  }
}

TEST_F(Registration, WhatTouchesTheColourCameraIsLeftOut) {
  CameraIntrinsics same = camera(70, 50, 60);
  same.cx = 35;
  same.cy = 25;
  set(same, same, Se3(Eigen::Quaterniond::Identity(), {0, 0, -1.0}));
  paint([](int x, int y) { return x == 35 && y == 25 ? 1.02 : 0.0; });
  apply();
  EXPECT_NEAR(at(35, 25), 0.02, 1e-5);
  paint([](int x, int y) { return x == 35 && y == 25 ? 1.005 : 0.0; });
  apply();
  EXPECT_EQ(at(35, 25), 0.0F);
}

TEST_F(Registration, NothingComesFromNothing) {
  set(camera(70, 50, 60), camera(70, 50, 60), turned(0.05, 0, 0, 0.1));
  apply();
  EXPECT_EQ(holes_within(0), 70U * 50U);
}

}  // namespace
}  // namespace posed::test
