#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/synthetic_camera.h"

/// A synthetic camera for tests, and the pictures it takes.
namespace posed {

inline CameraIntrinsics small_camera() {
  CameraIntrinsics camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 131.25;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// One rendered frame, copied out of the views.
struct Picture {
  std::vector<std::uint8_t> bgr;
  std::vector<std::uint8_t> gray;
  std::vector<float> depth_m;
  std::vector<std::uint8_t> mask;
  Se3 T_world_camera;

  float depth(int x, int y, int width) const { return depth_m[static_cast<std::size_t>(y * width + x)]; }
};

class Studio {
 public:
  explicit Studio(const SyntheticConfig& config, const CameraIntrinsics& intrinsics = small_camera())
      : camera_(std::move(*SyntheticCamera::create(config, intrinsics))) {}

  Picture take(std::uint64_t index) {
    const CameraIntrinsics& k = camera_->intrinsics();
    const auto pixels = static_cast<std::size_t>(k.width * k.height);
    Picture picture{std::vector<std::uint8_t>(3 * pixels), std::vector<std::uint8_t>(pixels), std::vector<float>(pixels),
                    std::vector<std::uint8_t>(pixels), Se3()};
    RgbdFrame frame;
    frame.bgr = {picture.bgr.data(), k.width, k.height, 3 * k.width, 3};
    frame.gray = {picture.gray.data(), k.width, k.height, k.width, 1};
    frame.depth_m = {picture.depth_m.data(), k.width, k.height, k.width, 1};
    const Status status = camera_->render(index, frame, {picture.mask.data(), k.width, k.height, k.width, 1});
    EXPECT_TRUE(status.has_value()) << (status ? "" : status.error().message);
    EXPECT_EQ(frame.sequence, index);
    EXPECT_EQ(frame.stamp_utc_ns, SyntheticCamera::kEpochUtc_ns + camera_->due_ns(index));
    picture.T_world_camera = frame.T_world_camera_truth.value();
    return picture;
  }

  SyntheticCamera& camera() { return *camera_; }

 private:
  std::unique_ptr<SyntheticCamera> camera_;
};

/// How many of the picture's cells of 40 x 40 pixels have ten pixels or more with a strong slope across and down: what corners are
/// made of.
inline int rich_cells(const Picture& picture, const CameraIntrinsics& k) {
  constexpr int kCell = 40;
  int rich = 0;
  for (int cell_y = 0; cell_y < k.height; cell_y += kCell) {
    for (int cell_x = 0; cell_x < k.width; cell_x += kCell) {
      int strong = 0;
      for (int y = cell_y + 1; y < cell_y + kCell - 1; ++y) {
        for (int x = cell_x + 1; x < cell_x + kCell - 1; ++x) {
          const std::uint8_t* at = picture.gray.data() + y * k.width + x;
          strong += std::abs(at[1] - at[-1]) > 16 && std::abs(at[k.width] - at[-k.width]) > 16 ? 1 : 0;
        }
      }
      rich += strong >= 10 ? 1 : 0;
    }
  }
  return rich;
}

}  // namespace posed
