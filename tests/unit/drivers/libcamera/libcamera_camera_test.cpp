#include "drivers/libcamera/libcamera_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/libcamera/libcamera_rig.h"

namespace posed::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LibcameraCameraTest : public ::testing::Test {
 protected:
  ~LibcameraCameraTest() override {
    EXPECT_THAT(rig_.color.violations(), IsEmpty());
    EXPECT_THAT(rig_.kernel.violations(), IsEmpty());
    EXPECT_FALSE(rig_.color.is_open());
    EXPECT_EQ(rig_.kernel.open_descriptors(), 0U);
    EXPECT_EQ(rig_.kernel.mappings(), 0U);
  }

  FrameWriter slot() { return *pool_.acquire(); }

  LibcameraRig rig_;
  FramePool pool_{LibcameraRig::kWidth, LibcameraRig::kHeight, 2};
};

TEST_F(LibcameraCameraTest, DeliversPairsOfOneInstant) {
  const auto camera = rig_.camera();
  EXPECT_EQ(camera->description(), "fake colour camera, depth /dev/video2");
  ASSERT_TRUE(camera->open());
  std::uint64_t first = 0;
  TimeNs first_ns = 0;
  for (std::uint64_t i = 0; i < 300; ++i) {
    FrameWriter frame = slot();
    ASSERT_EQ(rig_.read(*camera, &*frame).kind, CameraReadKind::Frame) << i;
    if (i == 0) {
      first = frame->sequence;
      first_ns = frame->capture_ns;
    }
    EXPECT_EQ(frame->sequence, first + i);
    EXPECT_NEAR(static_cast<double>(frame->depth_offset_ns), 0.0, 1e3) << "V4L2 tells microseconds";
    EXPECT_EQ(rig_.clock.now_ns() - frame->capture_ns, rig_.color.delay_ns) << "a completed image wakes the reader at once";
    EXPECT_EQ(frame->capture_ns, first_ns + static_cast<TimeNs>(i) * from_seconds(1.0 / 30)) << "the colour image's stamp";
    for (int y = 0; y < LibcameraRig::kHeight; ++y) {
      for (int x = 0; x < LibcameraRig::kWidth; ++x) {
        ASSERT_EQ(frame->bgr.row(y)[3 * x + 1], static_cast<std::uint8_t>(frame->sequence));
        ASSERT_EQ(frame->gray.row(y)[x], static_cast<std::uint8_t>(frame->sequence));
        ASSERT_FLOAT_EQ(frame->depth_m.row(y)[x], static_cast<float>(1000 + frame->sequence) / 1000.0F);
      }
    }
  }
  EXPECT_EQ(camera->metrics().unpaired.value(), 0U);
  EXPECT_EQ(camera->metrics().clock_resets.value(), 0U);
  EXPECT_EQ(rig_.color.queued(), rig_.color.buffers);
}

TEST_F(LibcameraCameraTest, SaysHowMuchLaterTheDepthImageWasTaken) {
  rig_.depth->phase_ns = 5 * kNsPerMs;
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  for (int delivered = 0; delivered < 10;) {
    FrameWriter frame = slot();
    const CameraRead got = rig_.read(*camera, &*frame);
    ASSERT_TRUE(got.kind == CameraReadKind::Frame || got.kind == CameraReadKind::Nothing);
    if (got.kind == CameraReadKind::Frame) {
      EXPECT_NEAR(static_cast<double>(frame->depth_offset_ns), 5e6, 1e3);
      ++delivered;
    }
  }
}

TEST_F(LibcameraCameraTest, WaitsNoLongerThanAsked) {
  rig_.color.silent_until_ns = 1'000 * kNsPerSecond;
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  const TimeNs begin_ns = rig_.clock.now_ns();
  EXPECT_EQ(camera->read(nullptr, 200 * kNsPerMs).kind, CameraReadKind::Nothing);
  EXPECT_EQ(rig_.clock.now_ns(), begin_ns + 200 * kNsPerMs);
}

TEST_F(LibcameraCameraTest, ADroppedImageIsAGapAndItsPartnerIsLetGo) {
  rig_.color.fate = [](std::uint64_t sequence) { return ColorFate{.dropped = sequence == 10}; };
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  std::vector<std::uint64_t> sequences;
  for (int i = 0; i < 20; ++i) {
    FrameWriter frame = slot();
    ASSERT_EQ(rig_.read(*camera, &*frame).kind, CameraReadKind::Frame);
    sequences.push_back(frame->sequence);
  }
  EXPECT_EQ(sequences[9], 9U);
  EXPECT_EQ(sequences[10], 11U);
  EXPECT_EQ(sequences[19], 20U);
  EXPECT_EQ(camera->metrics().unpaired.value(), 1U);
}

TEST_F(LibcameraCameraTest, TheSlowerCameraCountsTheFrames) {
  rig_.depth->rate_hz = 15;
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  std::optional<std::uint64_t> last;
  for (int i = 0; i < 30; ++i) {
    FrameWriter frame = slot();
    ASSERT_EQ(rig_.read(*camera, &*frame).kind, CameraReadKind::Frame);
    ASSERT_EQ(frame->sequence, last.value_or(frame->sequence - 1) + 1) << "a colour image without depth is no frame lost";
    last = frame->sequence;
  }
  EXPECT_GE(camera->metrics().unpaired.value(), 28U);  // every other colour image
}

TEST_F(LibcameraCameraTest, WithoutAFrameToFillImagesAreTakenAndLetGo) {
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(rig_.read(*camera, nullptr).kind, CameraReadKind::Frame);
  }
  EXPECT_EQ(rig_.color.queued(), rig_.color.buffers);
}

TEST_F(LibcameraCameraTest, ADamagedImageIsToldAndTheNextOneComes) {
  rig_.color.fate = [](std::uint64_t sequence) {
    return ColorFate{.kind = sequence == 3 ? CompletedImage::Kind::Damaged : CompletedImage::Kind::Filled};
  };
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  std::vector<CameraReadKind> kinds;
  for (int i = 0; i < 6; ++i) {
    const CameraRead got = rig_.read(*camera, nullptr);
    kinds.push_back(got.kind);
    if (got.kind == CameraReadKind::BadFrame) {
      EXPECT_THAT(got.error.message, HasSubstr("colour image 3"));
    }
  }
  using enum CameraReadKind;
  EXPECT_EQ(kinds, (std::vector<CameraReadKind>{Frame, Frame, Frame, BadFrame, Frame, Frame}));
  EXPECT_EQ(rig_.color.queued(), rig_.color.buffers) << "also the damaged image's buffer is given back";
}

TEST_F(LibcameraCameraTest, StampsOfAnotherClockAreMapped) {
  rig_.color.clock_offset_ns = 5'000 * kNsPerSecond;
  rig_.config.live.max_stamp_difference_s = 0.02;
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  TimeNs last_ns = 0;
  for (int i = 0; i < 100; ++i) {
    FrameWriter frame = slot();
    ASSERT_EQ(rig_.read(*camera, &*frame).kind, CameraReadKind::Frame);
    EXPECT_LE(frame->capture_ns, rig_.clock.now_ns());
    EXPECT_GT(frame->capture_ns, rig_.clock.now_ns() - 50 * kNsPerMs);
    EXPECT_GT(frame->capture_ns, last_ns);
    last_ns = frame->capture_ns;
  }
  EXPECT_EQ(camera->metrics().clock_resets.value(), 0U);

  camera->close();
  rig_.color.clock_offset_ns = 0;
  ASSERT_TRUE(camera->open());
  FrameWriter frame = slot();
  ASSERT_EQ(rig_.read(*camera, &*frame).kind, CameraReadKind::Frame);
  EXPECT_EQ(rig_.clock.now_ns() - frame->capture_ns, rig_.color.delay_ns) << "one that is opened again is believed again";
}

TEST_F(LibcameraCameraTest, AFailureIsForgottenWhenItIsOpenedAgain) {
  const auto camera = rig_.camera();
  ASSERT_TRUE(camera->open());
  rig_.color.give_back_error = Error{ErrorCode::Io, "no buffer is taken back"};
  ASSERT_EQ(rig_.read(*camera, nullptr).kind, CameraReadKind::Frame);
  camera->close();
  rig_.color.give_back_error.reset();
  ASSERT_TRUE(camera->open());
  EXPECT_EQ(rig_.read(*camera, nullptr).kind, CameraReadKind::Frame);
}

TEST_F(LibcameraCameraTest, MoreBuffersThanThereArePlacesAreRefused) {
  rig_.color.buffers = 65;
  const auto camera = rig_.camera();
  const Status opened = camera->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::Unsupported);
  EXPECT_FALSE(rig_.color.is_open());
}

}  // namespace
}  // namespace posed::test
