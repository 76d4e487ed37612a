#include <atomic>
#include <chrono>
#include <optional>
#include <stop_token>
#include <thread>

#include <gmock/gmock.h>

#include "tests/unit/drivers/openni2/openni2_rig.h"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const Clock& kClock = SystemClock::instance();

/// Images of the camera at some 100 Hz for as long as this lives, while its streams run.
class Flow {
 public:
  Flow()
      : thread_([](const std::stop_token& stop) {
          for (int i = 1; !stop.stop_requested(); ++i) {
            push_pair(static_cast<std::uint64_t>(kClock.now_ns() / 1000), i);
            std::this_thread::sleep_for(10ms);
          }
        }) {}

 private:
  std::jthread thread_;
};

/// The next capture that is not a frame.
std::optional<Capture> next_trouble(Running& running) {
  for (int frames = 0; frames < 1000; ++frames) {
    Capture capture = running.next(5s);
    if (capture.kind != CaptureKind::Frame) {
      return capture;
    }
  }
  return std::nullopt;
}

class OpenNi2FaultsTest : public OpenNi2Test {
 protected:
  OpenNi2FaultsTest() { fake_openni2().plug(fake_camera()); }
};

TEST_F(OpenNi2FaultsTest, DeliversAgainAfterItWasUnplugged) {
  const Flow flow;
  Running running(openni2_config(), kClock);
  ASSERT_EQ(running.next().kind, CaptureKind::Frame);
  for (int round = 1; round <= 3; ++round) {
    fake_openni2().unplug("fake/0");
    const std::optional<Capture> gone = next_trouble(running);
    ASSERT_TRUE(gone);
    EXPECT_EQ(gone->kind, CaptureKind::Interrupted);
    EXPECT_EQ(gone->error.message, "OpenNI2 camera 'fake/0' was unplugged");
    EXPECT_FALSE(running.health().connected);
    const Capture away = running.next();
    EXPECT_EQ(away.kind, CaptureKind::Interrupted);
    EXPECT_EQ(away.error.message, "OpenNI2 finds no camera");
    EXPECT_EQ(fake_openni2().state("fake/0").streams, 0) << "given back";
    EXPECT_EQ(running.next(300ms).kind, CaptureKind::Stopped) << "told once";

    fake_openni2().plug(fake_camera());
    const TimeNs plugged_ns = kClock.now_ns();
    const Capture again = running.next();
    ASSERT_EQ(again.kind, CaptureKind::Frame) << again.error.message;
    EXPECT_LT(kClock.now_ns() - plugged_ns, 2 * kNsPerSecond);
    EXPECT_TRUE(running.health().connected);
    EXPECT_EQ(running.health().reconnects, static_cast<std::uint64_t>(round));
  }
}

TEST_F(OpenNi2FaultsTest, WaitsForACameraThatIsPluggedLater) {
  fake_openni2().unplug("fake/0");
  const Flow flow;
  Running running(openni2_config(), kClock);
  const Capture away = running.next();
  EXPECT_EQ(away.kind, CaptureKind::Interrupted);
  EXPECT_EQ(away.error.code, ErrorCode::NotFound);
  EXPECT_FALSE(running.health().connected);
  fake_openni2().plug(fake_camera());
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
  EXPECT_EQ(running.health().reconnects, 0U);
}

TEST_F(OpenNi2FaultsTest, OpensACameraAnewThatReportsFailure) {
  const Flow flow;
  Running running(openni2_config(), kClock);
  ASSERT_EQ(running.next().kind, CaptureKind::Frame);
  fake_openni2().fail("fake/0");
  const std::optional<Capture> failed = next_trouble(running);
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->kind, CaptureKind::Interrupted);
  EXPECT_EQ(failed->error.message, "OpenNI2 camera 'fake/0' reports that it failed");
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
  EXPECT_EQ(fake_openni2().state("fake/0").times_opened, 2);
  EXPECT_EQ(fake_openni2().state("fake/0").times_closed, 1);
}

TEST_F(OpenNi2FaultsTest, OpensACameraAnewThatFallsSilent) {
  SourceConfig config = openni2_config();
  config.live.stall_timeout_s = 0.3;
  Running running(config, kClock);
  {
    const Flow flow;
    ASSERT_EQ(running.next().kind, CaptureKind::Frame);
  }
  std::optional<Capture> silent = next_trouble(running);
  ASSERT_TRUE(silent);
  EXPECT_EQ(silent->kind, CaptureKind::Interrupted);
  EXPECT_THAT(silent->error.message, HasSubstr("no frame for 0.3 s; it is opened again"));
  EXPECT_FALSE(running.health().connected);
  // It is tried again and again while it stays silent, and delivers as soon as there is something.
  EXPECT_EQ(running.next(1500ms).kind, CaptureKind::Stopped);
  EXPECT_GE(fake_openni2().state("fake/0").times_opened, 3);
  const Flow flow;
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
  EXPECT_GE(running.health().stalls, 2U);
  EXPECT_EQ(running.health().reconnects, 1U);
}

TEST_F(OpenNi2FaultsTest, ClosesBothStreamsWhereOneDoesNotStart) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.depth_starts = false;
  fake_openni2().change(camera);
  const Flow flow;
  Running running(openni2_config(), kClock);
  const Capture refused = running.next();
  EXPECT_EQ(refused.kind, CaptureKind::Interrupted);
  EXPECT_THAT(refused.error.message, HasSubstr("'fake/0': depth does not start"));
  const FakeOpenNi2State state = fake_openni2().state("fake/0");
  EXPECT_FALSE(state.color_runs);
  EXPECT_EQ(state.streams, 0);
  EXPECT_EQ(state.times_opened, state.times_closed);
  fake_openni2().change(fake_camera());
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
}

TEST_F(OpenNi2FaultsTest, DoesWithoutFrameSyncWhereTheCameraHasNone) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.can_sync = false;
  fake_openni2().change(camera);
  const Flow flow;
  Running running(openni2_config(), kClock);
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
  EXPECT_EQ(fake_openni2().state("fake/0").synced_streams, 2) << "it was asked";
}

TEST_F(OpenNi2FaultsTest, LosesFramesAndGoesOnWhereThePoolIsFull) {
  Running running(openni2_config(), kClock, 2);
  running.open();
  push_pair(1'000'000, 1);
  {
    const Capture held = running.next();
    ASSERT_EQ(held.kind, CaptureKind::Frame);
    push_pair(1'033'333, 2);
    const Capture also_held = running.next();
    ASSERT_EQ(also_held.kind, CaptureKind::Frame);
    push_pair(1'066'666, 3);
    EXPECT_EQ(running.next().kind, CaptureKind::NoFreeSlot);
    EXPECT_TRUE(shows(*held.frame, 1));
  }
  push_pair(1'099'999, 4);
  const Capture capture = running.next();
  ASSERT_EQ(capture.kind, CaptureKind::Frame);
  EXPECT_TRUE(shows(*capture.frame, 4));
  EXPECT_EQ(capture.frame->sequence, 3U) << "the frame that was lost is counted";
}

TEST_F(OpenNi2FaultsTest, SkipsAnImageOfAnotherSize) {
  SourceConfig config = openni2_config();
  config.openni2.frame_sync = false;
  Running running(config, kClock);
  running.open();
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(3 * 32 * 24));
  ASSERT_TRUE(fake_openni2().push("fake/0", ONI_SENSOR_COLOR,
                                  {pixels.data(), static_cast<int>(pixels.size()), 3 * 32, 32, 24, 1'000'000, 1}));
  const Capture bad = running.next();
  EXPECT_EQ(bad.kind, CaptureKind::SkippedFrame);
  EXPECT_THAT(bad.error.message, HasSubstr("delivered an image that is not 64x48 rgb888 at 30 Hz"));
  // Of the right size, but with fewer bytes than that takes.
  ASSERT_TRUE(fake_openni2().push("fake/0", ONI_SENSOR_COLOR,
                                  {pixels.data(), static_cast<int>(pixels.size()), 3 * kWidth, kWidth, kHeight, 1'010'000, 2}));
  EXPECT_EQ(running.next().kind, CaptureKind::SkippedFrame);
  push_pair(1'033'333, 3);
  EXPECT_EQ(running.next().kind, CaptureKind::Frame);
}

}  // namespace
}  // namespace posed::test
