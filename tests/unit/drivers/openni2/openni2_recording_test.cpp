#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include <gmock/gmock.h>

#include "drivers/openni2/openni2_api.h"
#include "drivers/openni2/openni2_source.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/drivers/openni2/openni2_rig.h"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const Clock& kClock = SystemClock::instance();
constexpr int kFrames = 40;
constexpr std::uint64_t kPeriod_us = 20'000;
constexpr std::uint64_t kFirst_us = 10'000'000;
constexpr std::uint64_t kLeadIn_us = 2'100'000;
constexpr std::uint64_t kMostLeadIn = 2000;  // ms
constexpr std::uintmax_t kColorImage_bytes = 3 * kWidth * kHeight;
constexpr std::uintmax_t kUnfinished_bytes = kFrames / 2 * kColorImage_bytes;

/// Which image it is, by one pixel's colour: those of fewer than 256 images differ.
int index_of(const RgbdFrame& frame) {
  for (int index = 0; index < 256; ++index) {
    if ((&frame.bgr.at(3, 4))[2] == test_color(3, 4, 0, index)) {
      return index;
    }
  }
  return -1;
}

class OpenNi2RecordingTest : public OpenNi2Test {
 protected:
  OpenNi2RecordingTest() { fake_openni2().plug(fake_camera()); }

  /// Records some images number 0, then those from 1 to kFrames, of which one colour image is missing; says how many bytes it
  /// wrote.
  void record(const std::string& path, bool mirrored = false, const std::string& unfinished = {}) {
    openni::OpenNI::initialize();
    {
      openni::Device device;
      EXPECT_EQ(device.open(openni::ANY_DEVICE), openni::STATUS_OK);
      openni::VideoStream color;
      openni::VideoStream depth;
      color.create(device, openni::SENSOR_COLOR);
      depth.create(device, openni::SENSOR_DEPTH);
      color.setMirroringEnabled(mirrored);
      depth.setMirroringEnabled(mirrored);
      color.start();
      depth.start();
      openni::Recorder recorder;
      EXPECT_EQ(recorder.create(path.c_str()), openni::STATUS_OK);
      recorder.attach(color);
      recorder.attach(depth);
      recorder.start();
      // The recorder's thread cannot say when it is ready: images number 0 until some are in the file.
      for (std::uint64_t i = 0; std::filesystem::file_size(path) < 4 * kColorImage_bytes && i < kMostLeadIn; ++i) {
        push_pair(kFirst_us - kLeadIn_us + 1000 * i, 0);
        std::this_thread::sleep_for(1ms);
      }
      for (int i = 1; i <= kFrames; ++i) {
        const std::uint64_t stamp_us = kFirst_us + static_cast<std::uint64_t>(i) * kPeriod_us;
        if (i != kMissing) {
          push_color(stamp_us, i);
        }
        push_depth(stamp_us + 1000, i);
      }
      if (!unfinished.empty()) {
        while (std::filesystem::file_size(path) < kUnfinished_bytes) {
          std::this_thread::sleep_for(1ms);
        }
        std::filesystem::copy_file(path, unfinished);
        std::filesystem::resize_file(unfinished, kUnfinished_bytes);
      }
      recorder.stop();
      recorder.destroy();
      color.stop();
      depth.stop();
      color.destroy();
      depth.destroy();
      device.close();
    }
    openni::OpenNI::shutdown();
  }

  SourceConfig playing(const std::string& path, Pacing pacing) const {
    SourceConfig config = openni2_config();
    config.openni2.device = path;
    config.pacing = pacing;
    return config;
  }

  static constexpr int kMissing = 11;
  const TemporaryFolder folder_;
};

/// All that is told of a frame, and its pixels.
struct Seen {
  std::uint64_t sequence;
  std::int64_t stamp_utc_ns;
  int index;
  bool operator==(const Seen&) const = default;
};

/// The lead-in is one image, and as long as the recorder's thread takes to be ready: beyond some repeats the source leaves it out.
Capture next_after_lead_in(Running& running) {
  Capture capture = running.next();
  while (capture.kind == CaptureKind::SkippedFrame && capture.error.message.find("repeats one image") != std::string::npos) {
    capture = running.next();
  }
  return capture;
}

std::vector<Seen> play(const SourceConfig& config) {
  Running running(config, kClock);
  std::vector<Seen> seen;
  for (;;) {
    const Capture capture = next_after_lead_in(running);
    if (capture.kind != CaptureKind::Frame) {
      EXPECT_EQ(capture.kind, CaptureKind::EndOfStream) << capture.error.message;
      EXPECT_EQ(running.next().kind, CaptureKind::EndOfStream) << "and it stays so";
      return seen;
    }
    const int index = index_of(*capture.frame);
    EXPECT_TRUE(shows(*capture.frame, index));
    seen.push_back({capture.frame->sequence, capture.frame->stamp_utc_ns, index});
  }
}

TEST_F(OpenNi2RecordingTest, LockstepDeliversEachFrameAndRepeatsExactly) {
  const std::string path = folder_ / "walk.oni";
  record(path);
  const std::vector<Seen> first = play(playing(path, Pacing::Lockstep));
  const auto begin = std::find_if(first.begin(), first.end(), [](const Seen& seen) { return seen.index == 1; });
  ASSERT_EQ(std::distance(begin, first.end()), kFrames - 1);
  int index = 1;
  for (auto seen = begin; seen != first.end(); ++seen) {
    index += index == kMissing ? 1 : 0;
    EXPECT_EQ(seen->index, index);
    EXPECT_EQ(seen->stamp_utc_ns - begin->stamp_utc_ns, (index - 1) * static_cast<std::int64_t>(kPeriod_us) * 1000);
    ++index;
  }
  for (int again = 0; again < 5; ++again) {
    EXPECT_EQ(play(playing(path, Pacing::Lockstep)), first);
  }
}

TEST_F(OpenNi2RecordingTest, RealtimeKeepsToTheStampsAndEnds) {
  const std::string path = folder_ / "walk.oni";
  record(path);
  Running running(playing(path, Pacing::Realtime), kClock);
  TimeNs first_ns = 0;
  int frames = 0;
  Capture capture = next_after_lead_in(running);
  for (; capture.kind == CaptureKind::Frame; capture = next_after_lead_in(running)) {
    EXPECT_GE(kClock.now_ns(), capture.frame->capture_ns) << "never before it is due";
    const int index = index_of(*capture.frame);
    if (index == 0) {
      continue;
    }
    first_ns = index == 1 ? capture.frame->capture_ns : first_ns;
    EXPECT_EQ(capture.frame->capture_ns - first_ns, (index - 1) * static_cast<TimeNs>(kPeriod_us) * 1000);
    ++frames;
  }
  EXPECT_EQ(capture.kind, CaptureKind::EndOfStream) << capture.error.message;
  EXPECT_EQ(frames, kFrames - 1);
  EXPECT_GE(running.health().unpaired, 1U);
  EXPECT_EQ(running.health().stalls, 0U);
}

TEST_F(OpenNi2RecordingTest, IsNotACameraThatIsFoundLater) {
  const std::string path = folder_ / "walk.oni";
  record(path);
  Running recording(playing(path, Pacing::Lockstep), kClock);
  ASSERT_EQ(recording.next().kind, CaptureKind::Frame);
  fake_openni2().unplug("fake/0");
  const Result<std::vector<ListedCamera>> listed = list_openni2_cameras();
  ASSERT_TRUE(listed);
  EXPECT_TRUE(listed->empty());
  Running camera(openni2_config(), kClock);
  EXPECT_EQ(camera.next().error.message, "OpenNI2 finds no camera");
}

TEST_F(OpenNi2RecordingTest, CanBeGivenUpInTheMiddle) {
  const std::string path = folder_ / "walk.oni";
  record(path);
  for (int frames = 0; frames < 6; ++frames) {
    Running running(playing(path, Pacing::Lockstep), kClock);
    for (int i = 0; i < frames; ++i) {
      ASSERT_EQ(running.next().kind, CaptureKind::Frame);
    }
  }
}

TEST_F(OpenNi2RecordingTest, TurnsWhatWasRecordedMirrored) {
  const std::string path = folder_ / "mirrored.oni";
  record(path, true);
  Running running(playing(path, Pacing::Lockstep), kClock);
  const Capture capture = running.next();
  ASSERT_EQ(capture.kind, CaptureKind::Frame) << capture.error.message;
  EXPECT_EQ((&capture.frame->bgr.at(0, 5))[2], test_color(kWidth - 1, 5, 0, 0));
  EXPECT_EQ(capture.frame->depth_m.at(kWidth - 1, 5), 0.0F);
  EXPECT_GT(capture.frame->depth_m.at(0, 5), 0.0F);
}

TEST_F(OpenNi2RecordingTest, SaysWhereItBreaksOff) {
  const std::string whole = folder_ / "whole.oni";
  const std::string path = folder_ / "broken.oni";
  record(whole, false, path);
  const auto frames_of_whole = static_cast<int>(play(playing(whole, Pacing::Lockstep)).size());
  for (const Pacing pacing : {Pacing::Lockstep, Pacing::Realtime}) {
    SourceConfig config = playing(path, pacing);
    config.live.stall_timeout_s = 0.3;
    Running running(config, kClock);
    Capture capture = next_after_lead_in(running);
    int frames = 0;
    for (; capture.kind == CaptureKind::Frame; capture = next_after_lead_in(running)) {
      ++frames;
    }
    EXPECT_GT(frames, kFrames / 8);
    EXPECT_LT(frames, frames_of_whole);
    EXPECT_EQ(capture.kind, CaptureKind::SkippedFrame);
    EXPECT_THAT(capture.error.message, HasSubstr("breaks off"));
    EXPECT_EQ(running.next().kind, CaptureKind::EndOfStream);
  }
}

TEST_F(OpenNi2RecordingTest, SaysWhatIsWrongWithAFile) {
  const auto made = [&](const std::string& path) {
    return make_openni2_source(playing(path, Pacing::Lockstep), small_camera(), kClock);
  };
  EXPECT_EQ(made(folder_ / "none.oni").error().code, ErrorCode::NotFound);
  EXPECT_THAT(made(folder_ / "none.oni").error().message, HasSubstr("there is no recording"));
  EXPECT_THAT(made(std::string(300, 'x') + ".oni").error().message, HasSubstr("304 characters, and OpenNI2 keeps 255"));

  const std::string text = folder_.write("text.oni", "this is no recording").string();
  EXPECT_EQ(made(text).error().code, ErrorCode::BadData);
  EXPECT_THAT(made(text).error().message, HasSubstr("cannot be read as an OpenNI recording"));

  const std::string path = folder_ / "walk.oni";
  record(path);
  CameraIntrinsics larger = small_camera();
  larger.width = 640;
  larger.height = 480;
  const auto wrong_size = make_openni2_source(playing(path, Pacing::Lockstep), larger, kClock);
  ASSERT_FALSE(wrong_size);
  EXPECT_EQ(wrong_size.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(wrong_size.error().message, HasSubstr("holds colour as 64x48 rgb888 at 30 Hz; the calibration's size is 640x480"));
}

}  // namespace
}  // namespace posed::test
