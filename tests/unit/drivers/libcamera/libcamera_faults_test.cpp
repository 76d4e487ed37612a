#include <filesystem>
#include <iterator>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/libcamera/libcamera_rig.h"

namespace posed::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A source on the rig, run until something comes of it.
class LibcameraFaultsTest : public ::testing::Test {
 protected:
  LibcameraFaultsTest() {
    source_ = make_camera_source(rig_.camera(), {LibcameraRig::kWidth, LibcameraRig::kHeight, rig_.config.live, Pacing::Realtime},
                                 rig_.clock);
    EXPECT_TRUE(source_->start(pool_));
  }
  ~LibcameraFaultsTest() override {
    source_.reset();
    EXPECT_THAT(rig_.color.violations(), IsEmpty());
    EXPECT_THAT(rig_.kernel.violations(), IsEmpty());
    EXPECT_FALSE(rig_.color.is_open());
    EXPECT_EQ(rig_.kernel.open_descriptors(), 0U);
    EXPECT_EQ(rig_.kernel.mappings(), 0U);
  }

  void expect_frames(int count) {
    for (int i = 0; i < count; ++i) {
      const Capture capture = source_->next({});
      ASSERT_EQ(capture.kind, CaptureKind::Frame) << i << " " << capture.error.message;
    }
    EXPECT_TRUE(source_->health().connected);
  }

  void expect_interruption(const char* reason) {
    const Capture capture = source_->next({});
    ASSERT_EQ(capture.kind, CaptureKind::Interrupted);
    EXPECT_THAT(capture.error.message, HasSubstr(reason));
    EXPECT_FALSE(source_->health().connected);
    EXPECT_FALSE(rig_.color.is_open()) << "both are closed, to be opened again";
    EXPECT_EQ(rig_.kernel.open_descriptors(), 0U);
  }

  FramePool pool_{LibcameraRig::kWidth, LibcameraRig::kHeight, 4};
  LibcameraRig rig_;
  std::unique_ptr<RgbdSource> source_;
};

TEST_F(LibcameraFaultsTest, AColourCameraThatIsPulledOutAndComesBack) {
  expect_frames(10);
  rig_.color.disconnect();
  expect_interruption("the colour camera was disconnected");
  const Capture away = source_->next({});
  EXPECT_EQ(away.kind, CaptureKind::Interrupted);
  EXPECT_THAT(away.error.message, HasSubstr("the colour camera is away"));
  rig_.color.present = true;
  expect_frames(10);
  EXPECT_EQ(source_->health().reconnects, 1U);
}

TEST_F(LibcameraFaultsTest, AColourCameraThatCancelsItsRequests) {
  rig_.color.fate = [this](std::uint64_t sequence) {
    return ColorFate{.kind = rig_.color.opened() == 1 && sequence == 5 ? CompletedImage::Kind::Cancelled
                                                                       : CompletedImage::Kind::Filled};
  };
  expect_frames(5);
  expect_interruption("the colour camera has stopped");
  expect_frames(10);
  EXPECT_EQ(source_->health().reconnects, 1U);
}

TEST_F(LibcameraFaultsTest, AColourCameraThatFallsSilentIsAStall) {
  expect_frames(5);
  rig_.color.silent_until_ns = rig_.clock.now_ns() + from_seconds(1.5);
  expect_interruption("no frame for 1.0 s");
  expect_frames(5);
  EXPECT_EQ(source_->health().stalls, 1U);
  EXPECT_EQ(source_->health().reconnects, 1U);
  EXPECT_EQ(rig_.color.opened(), 2);
}

TEST_F(LibcameraFaultsTest, ADepthCameraThatFallsSilentIsAStallAndKeepsNoColourBuffers) {
  expect_frames(5);
  rig_.kernel.silence(LibcameraRig::kDepth, rig_.clock.now_ns() + from_seconds(1.5));
  expect_interruption("no frame for 1.0 s");
  expect_frames(5);
  EXPECT_EQ(source_->health().stalls, 1U);
  EXPECT_GT(source_->health().unpaired, 20U);
}

TEST_F(LibcameraFaultsTest, ADepthCameraThatIsPulledOutAndComesBack) {
  expect_frames(5);
  rig_.kernel.unplug(LibcameraRig::kDepth);
  expect_interruption(LibcameraRig::kDepth);
  EXPECT_EQ(source_->next({}).kind, CaptureKind::Interrupted);
  rig_.kernel.replug(LibcameraRig::kDepth);
  expect_frames(5);
  EXPECT_EQ(source_->health().reconnects, 1U);
}

TEST_F(LibcameraFaultsTest, AColourCameraThatTakesNoBufferBack) {
  expect_frames(5);
  rig_.color.give_back_error = Error{ErrorCode::Io, "no buffer is taken back"};
  expect_frames(1);
  expect_interruption("no buffer is taken back");
  rig_.color.give_back_error.reset();
  expect_frames(5);
}

TEST_F(LibcameraFaultsTest, AThousandReconnectionsLeakNothing) {
  const auto descriptors = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  expect_frames(1);
  const auto before = descriptors();
  for (int i = 0; i < 1000; ++i) {
    rig_.color.disconnect();
    ASSERT_EQ(source_->next({}).kind, CaptureKind::Interrupted);
    rig_.color.present = true;
    expect_frames(1);
  }
  EXPECT_EQ(source_->health().reconnects, 1000U);
  EXPECT_EQ(descriptors(), before);
}

}  // namespace
}  // namespace posed::test
