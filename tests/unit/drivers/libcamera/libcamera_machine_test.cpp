#include <filesystem>
#include <stop_token>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/frame_pool.h"
#include "drivers/libcamera/libcamera_device.h"
#include "drivers/libcamera/libcamera_listing.h"
#include "drivers/rgbd_source.h"

/// libcamera itself, on whatever machine this is.
namespace posed {
namespace {

using ::testing::HasSubstr;

class Nobody final : public CompletionSink {
 public:
  void on_completed(const CompletedImage&) noexcept override {}
  void on_disconnected() noexcept override {}
};

TEST(LibcameraMachine, ListsCamerasAgainAndAgain) {
  for (int i = 0; i < 3; ++i) {
    const auto cameras = list_libcamera_cameras();
    ASSERT_TRUE(cameras) << cameras.error().message;
    if (!std::filesystem::exists("/dev/media0")) {
      EXPECT_TRUE(cameras->empty());
    }
    for (const ListedCamera& camera : *cameras) {
      EXPECT_EQ(camera.kind, "libcamera");
      EXPECT_FALSE(camera.id.empty());
    }
  }
}

TEST(LibcameraMachine, ACameraThatIsNotThereIsNotFound) {
  LibcameraConfig config;
  config.camera = "no such camera";
  const auto device = make_libcamera_device(config, {}, 30, SystemClock::instance());
  Nobody sink;
  for (int i = 0; i < 3; ++i) {
    const Status opened = device->open(sink);
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::NotFound);
    EXPECT_THAT(opened.error().message, HasSubstr("libcamera camera no such camera: libcamera "));
    device->close();
  }
}

TEST(LibcameraMachine, TheSourceWaitsForItsCamera) {
  SourceConfig config;
  config.kind = SourceKind::Libcamera;
  config.libcamera.camera = "no such camera";
  const auto without_depth = make_rgbd_source(config, {}, SystemClock::instance());
  ASSERT_FALSE(without_depth);
  EXPECT_EQ(without_depth.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(without_depth.error().message, HasSubstr("source.depth.device"));

  config.depth.node.device = "/dev/no-such-node";
  CameraIntrinsics intrinsics;
  intrinsics.width = 16;
  intrinsics.height = 8;
  const auto source = make_rgbd_source(config, intrinsics, SystemClock::instance());
  ASSERT_TRUE(source) << source.error().message;
  FramePool pool(16, 8, 2);
  ASSERT_TRUE((*source)->start(pool));
  const Capture capture = (*source)->next({});
  EXPECT_EQ(capture.kind, CaptureKind::Interrupted);
  EXPECT_THAT(capture.error.message, HasSubstr("no such camera"));
  EXPECT_FALSE((*source)->health().connected);
}

}  // namespace
}  // namespace posed
