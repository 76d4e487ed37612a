#pragma once

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "config/config.h"
#include "core/frame_pool.h"
#include "drivers/camera_source.h"
#include "drivers/v4l2/v4l2_camera.h"
#include "tests/support/fake_v4l2.h"
#include "tests/support/scripted_clock.h"

namespace posed::test {

inline constexpr const char* kColorPath = "/dev/video0";
inline constexpr const char* kDepthPath = "/dev/video2";
inline constexpr int kRigWidth = 16;
inline constexpr int kRigHeight = 8;
inline constexpr std::pair<std::uint32_t, std::uint32_t> kRigSize{kRigWidth, kRigHeight};

/// A colour and a depth camera that a test plugs, pulls and breaks; both take tiny images of one time at 30 Hz.
class V4l2Rig {
 public:
  V4l2Rig() : kernel_(clock_) {
    FakeCamera color;
    color.formats = {{V4L2_PIX_FMT_YUYV, {kRigSize}}};
    color.paint = [](std::uint64_t sequence, const v4l2_pix_format&, std::vector<std::uint8_t>& image) {
      std::memset(image.data(), 16 + static_cast<int>(sequence % 200), image.size());
    };
    FakeCamera depth;
    depth.formats = {{V4L2_PIX_FMT_Z16, {kRigSize}}};
    depth.paint = [](std::uint64_t sequence, const v4l2_pix_format&, std::vector<std::uint8_t>& image) {
      std::memset(image.data(), 1 + static_cast<int>(sequence % 100), image.size());
    };
    color_ = &kernel_.plug(kColorPath, std::move(color));
    depth_ = &kernel_.plug(kDepthPath, std::move(depth));
    config_.kind = SourceKind::V4l2;
    config_.v4l2.device = kColorPath;
    config_.depth.node.device = kDepthPath;
    intrinsics_.width = kRigWidth;
    intrinsics_.height = kRigHeight;
    intrinsics_.depth_units_per_metre = 1000.0;
  }

  std::unique_ptr<V4l2Camera> camera() { return std::make_unique<V4l2Camera>(kernel_, config_, intrinsics_, clock_); }

  std::unique_ptr<RgbdSource> source(FramePool& pool) {
    std::unique_ptr<RgbdSource> source =
        make_camera_source(camera(), {intrinsics_.width, intrinsics_.height, config_.live, config_.pacing}, clock_);
    if (const Status started = source->start(pool); !started) {
      throw std::runtime_error(started.error().message);
    }
    return source;
  }

  ScriptedClock clock_;
  FakeKernel kernel_;
  FakeCamera* color_ = nullptr;
  FakeCamera* depth_ = nullptr;
  SourceConfig config_;
  CameraIntrinsics intrinsics_;
};

}  // namespace posed::test
