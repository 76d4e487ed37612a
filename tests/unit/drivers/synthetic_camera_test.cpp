#include "drivers/synthetic_camera.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/frame_pool.h"
#include "tests/unit/drivers/synthetic_studio.h"

namespace posed {
namespace {

TEST(SyntheticCamera, FrameDependsOnIndexAlone) {
  SyntheticConfig config;
  Studio one(config);
  Studio two(config);
  const Picture later = one.take(90);
  const Picture first = one.take(0);
  two.take(33);
  const Picture again = two.take(90);
  EXPECT_EQ(later.bgr, again.bgr);
  EXPECT_EQ(later.gray, again.gray);
  EXPECT_EQ(later.depth_m, again.depth_m);
  EXPECT_EQ(later.mask, again.mask);
  EXPECT_NE(later.bgr, first.bgr);
}

TEST(SyntheticCamera, SeedsDiffer) {
  SyntheticConfig config;
  const Picture one = Studio(config).take(0);
  config.seed = 2;
  const Picture two = Studio(config).take(0);
  EXPECT_NE(one.bgr, two.bgr);
  EXPECT_NE(one.depth_m, two.depth_m);
  EXPECT_GT((one.T_world_camera.inverse() * two.T_world_camera).log().norm(), 0.01);
}

/// Inverse depth of `picture` at a fractional pixel, by interpolation, which is exact on a plane; nothing where the sixteen pixels
/// around it do not show a single plane.
std::optional<double> inverse_depth_on_plane(const Picture& picture, int width, int height, const Eigen::Vector2d& pixel) {
  const int u = static_cast<int>(std::floor(pixel.x()));
  const int v = static_cast<int>(std::floor(pixel.y()));
  if (u < 1 || v < 1 || u + 2 >= width || v + 2 >= height) {
    return std::nullopt;
  }
  const auto inverse = [&](int x, int y) { return 1.0 / static_cast<double>(picture.depth(x, y, width)); };
  const double slope_x = inverse(u + 1, v) - inverse(u, v);
  const double slope_y = inverse(u, v + 1) - inverse(u, v);
  for (int dy = -1; dy <= 2; ++dy) {
    for (int dx = -1; dx <= 2; ++dx) {
      if (std::abs(inverse(u, v) + dx * slope_x + dy * slope_y - inverse(u + dx, v + dy)) > 3e-4) {
        return std::nullopt;
      }
    }
  }
  return inverse(u, v) + (pixel.x() - u) * slope_x + (pixel.y() - v) * slope_y;
}

/// Takes points from one frame's depth to another's pixels through the true poses: the depths there agree.
void expect_depths_agree(const CameraIntrinsics& intrinsics) {
  SyntheticConfig config;
  config.people = 0;
  config.sensor_noise = false;
  Studio studio(config, intrinsics);
  const PinholeCamera lens(intrinsics);
  const Picture from = studio.take(200);
  const Picture to = studio.take(224);
  const Se3 T_to_from = to.T_world_camera.inverse() * from.T_world_camera;
  int compared = 0;
  int agreeing = 0;
  int in_front = 0;
  for (int y = 0; y < intrinsics.height; ++y) {
    for (int x = 0; x < intrinsics.width; ++x) {
      const float z = from.depth(x, y, intrinsics.width);
      ASSERT_GT(z, 0.3F);
      const Eigen::Vector3d p = T_to_from * lens.unproject(lens.undistort(Eigen::Vector2d(x, y)), static_cast<double>(z));
      if (p.z() < 0.1) {
        continue;
      }
      const auto inverse = inverse_depth_on_plane(to, intrinsics.width, intrinsics.height, lens.distort(lens.project(p)));
      if (inverse) {
        ++compared;
        agreeing += std::abs(1.0 / *inverse - p.z()) < 0.002 ? 1 : 0;
        in_front += 1.0 / *inverse > p.z() + 0.01 ? 1 : 0;  // a visible point cannot lie before what the other frame sees
      }
    }
  }
  EXPECT_GT(compared, intrinsics.width * intrinsics.height / 3);
  EXPECT_GT(agreeing, compared * 96 / 100);  // the others are hidden in the second frame
  EXPECT_LT(in_front, compared / 500);
}

TEST(SyntheticCamera, DepthFitsTheTruePoses) {
  expect_depths_agree(small_camera());
}

TEST(SyntheticCamera, DepthFitsTheTruePosesThroughALens) {
  CameraIntrinsics camera = small_camera();
  camera.k1 = 0.12;
  camera.k2 = -0.2;
  camera.p1 = 0.002;
  camera.p2 = -0.001;
  expect_depths_agree(camera);
}

TEST(SyntheticCamera, MasksCoverPeopleExactly) {
  SyntheticConfig config;
  config.sensor_noise = false;
  Studio peopled(config);
  config.people = 0;
  Studio empty(config);
  constexpr int kFrames = 40;
  int with_people = 0;
  double moved = 0;
  std::vector<std::uint8_t> previous;
  for (int i = 0; i < kFrames; ++i) {  // 20 s
    const auto index = static_cast<std::uint64_t>(15 * i);
    const Picture seen = peopled.take(index);
    const Picture bare = empty.take(index);
    int masked = 0;
    int changed = 0;
    for (std::size_t k = 0; k < seen.mask.size(); ++k) {
      ASSERT_TRUE(seen.mask[k] == 0 || seen.mask[k] == 255);
      if (seen.mask[k] != 0) {
        ASSERT_LT(seen.depth_m[k], bare.depth_m[k]);
        ++masked;
      } else {
        ASSERT_EQ(seen.depth_m[k], bare.depth_m[k]);
      }
      changed += !previous.empty() && seen.mask[k] != previous[k] ? 1 : 0;
    }
    const auto pixels = static_cast<int>(seen.mask.size());
    with_people += masked > pixels / 100 ? 1 : 0;
    moved += static_cast<double>(changed) / pixels;
    previous = seen.mask;
  }
  EXPECT_GE(with_people, kFrames / 2);
  EXPECT_GT(moved / kFrames, 0.03);
}

TEST(SyntheticCamera, PicturesAreRichInTexture) {
  SyntheticConfig config;
  config.people = 0;
  Studio studio(config);
  for (const std::uint64_t index : {0U, 300U, 600U, 900U, 1200U, 1500U}) {
    const Picture picture = studio.take(index);
    EXPECT_GE(rich_cells(picture, small_camera()), 9) << "of 12 cells, frame " << index;
  }
}

TEST(SyntheticCamera, RefusesWhatItCannotDo) {
  SyntheticConfig config;
  config.people = SyntheticWorld::kMaxPeople + 1;
  const auto crowd = SyntheticCamera::create(config, small_camera());
  ASSERT_FALSE(crowd.has_value());
  EXPECT_EQ(crowd.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(crowd.error().message.find("source.synthetic.people = 9"), std::string::npos);
  config.people = 1;
  config.world = SyntheticWorldKind::Corridor;
  const auto passer_by = SyntheticCamera::create(config, small_camera());
  ASSERT_FALSE(passer_by.has_value());
  EXPECT_EQ(passer_by.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(passer_by.error().message.find("source.synthetic.people = 1: only source.synthetic.world = \"room\""),
            std::string::npos)
      << passer_by.error().message;
  config.world = SyntheticWorldKind::Room;
  config.people = 0;
  config.rate_hz = 0;
  EXPECT_FALSE(SyntheticCamera::create(config, small_camera()).has_value());
  config.rate_hz = 30;
  config.duration_s = -1;
  EXPECT_FALSE(SyntheticCamera::create(config, small_camera()).has_value());
  config.duration_s = 0;
  CameraIntrinsics broken = small_camera();
  broken.fx = 0;
  EXPECT_FALSE(SyntheticCamera::create(config, broken).has_value());

  Studio studio(config);
  FramePool larger(320, 240, 1);
  auto writer = larger.acquire();
  const Status status = studio.camera().render(0, **writer);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
}

TEST(SyntheticCamera, CountsTheFramesOfItsDuration) {
  SyntheticConfig config;
  config.people = 0;
  config.duration_s = 2.0;
  EXPECT_EQ(Studio(config).camera().total_frames(), 60U);
}

}  // namespace
}  // namespace posed
