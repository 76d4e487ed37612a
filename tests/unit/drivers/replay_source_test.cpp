#include "drivers/replay_source.h"

#include <chrono>
#include <cstring>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/image_writer.h"
#include "tests/support/test_recording.h"

namespace posed {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kFrames = 6;

std::vector<std::uint8_t> pixels_of(const RgbdFrame& frame) {
  std::vector<std::uint8_t> bytes;
  const auto append = [&](const auto& view) {
    for (int y = 0; y < view.height; ++y) {
      const auto* row = reinterpret_cast<const std::uint8_t*>(view.row(y));
      bytes.insert(bytes.end(), row, row + static_cast<std::size_t>(view.width * view.channels) * sizeof(*view.data));
    }
  };
  append(frame.bgr);
  append(frame.gray);
  append(frame.depth_m);
  return bytes;
}

class Replay : public testing::Test {
 protected:
  Replay() : pool_(kTestWidth, kTestHeight, 8) {
    config_.kind = SourceKind::Replay;
    config_.pacing = Pacing::Lockstep;
    config_.replay.sequence = folder_.path().string();
    config_.replay.decode_ahead = 3;
    camera_.width = kTestWidth;
    camera_.height = kTestHeight;
    write_recording(folder_.path(), kFrames);
  }

  std::unique_ptr<RgbdSource> open() {
    Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config_, camera_, clock_);
    if (!source) {
      throw std::runtime_error(source.error().message);
    }
    return *std::move(source);
  }
  std::unique_ptr<RgbdSource> open_and_start() {
    std::unique_ptr<RgbdSource> source = open();
    if (const Status started = source->start(pool_); !started) {
      throw std::runtime_error(started.error().message);
    }
    return source;
  }
  std::string open_error() {
    const Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config_, camera_, clock_);
    return source ? "no error" : source.error().message;
  }

  std::string stamp(int frame) const { return format_stamp_of(kTestStampNs + frame * kTestPeriodNs); }
  std::filesystem::path color(int frame) const { return folder_.path() / "rgb" / (stamp(frame) + ".png"); }
  std::filesystem::path depth(int frame) const { return folder_.path() / "depth" / (stamp(frame) + ".png"); }
  static std::string format_stamp_of(std::int64_t ns) {
    const std::string digits = std::to_string(ns);
    return digits.substr(0, digits.size() - 9) + "." + digits.substr(digits.size() - 9);
  }

  TemporaryFolder folder_;
  SteppedClock clock_;
  FramePool pool_;
  SourceConfig config_;
  CameraIntrinsics camera_;
  std::stop_source stop_;
};

/// Everything a source has to say, frames dropped at once.
struct Played {
  std::vector<std::uint64_t> sequences;
  std::vector<std::int64_t> stamps;
  std::vector<TimeNs> captures;
  std::vector<std::uint8_t> pixels;
  std::vector<std::string> skipped;
  int no_slot = 0;
  CaptureKind end = CaptureKind::Stopped;
  std::string end_message;
};

Played play(RgbdSource& source, std::size_t at_most = 1000) {
  Played played;
  while (played.sequences.size() < at_most) {
    Capture capture = source.next({});
    switch (capture.kind) {
      case CaptureKind::Frame: {
        played.sequences.push_back(capture.frame->sequence);
        played.stamps.push_back(capture.frame->stamp_utc_ns);
        played.captures.push_back(capture.frame->capture_ns);
        const std::vector<std::uint8_t> pixels = pixels_of(*capture.frame);
        played.pixels.insert(played.pixels.end(), pixels.begin(), pixels.end());
        break;
      }
      case CaptureKind::SkippedFrame: played.skipped.push_back(capture.error.message); break;
      case CaptureKind::NoFreeSlot: ++played.no_slot; break;
      default:
        played.end = capture.kind;
        played.end_message = capture.error.message;
        return played;
    }
  }
  return played;
}

TEST_F(Replay, SaysWhatItIs) {
  const std::unique_ptr<RgbdSource> source = open();
  EXPECT_EQ(source->info().description, "replay of " + folder_.path().string() + ", 6 frames");
  EXPECT_EQ(source->info().total_frames, 6U);
  EXPECT_EQ(source->info().width, kTestWidth);
  EXPECT_EQ(source->info().height, kTestHeight);
  EXPECT_EQ(source->info().slots_held, 3U);
  EXPECT_NEAR(source->info().rate_hz, 30.0, 1e-5);
  config_.replay.loop = true;
  EXPECT_EQ(open()->info().total_frames, 0U) << "endless";
}

TEST_F(Replay, LockstepDeliversAllInOrderTwiceTheSame) {
  const Played first = play(*open_and_start());
  const Played second = play(*open_and_start());
  EXPECT_THAT(first.sequences, ElementsAre(0, 1, 2, 3, 4, 5));
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(first.stamps[static_cast<std::size_t>(i)], kTestStampNs + i * kTestPeriodNs);
  }
  EXPECT_EQ(first.end, CaptureKind::EndOfStream);
  EXPECT_TRUE(first.skipped.empty());
  EXPECT_EQ(first.pixels, second.pixels);
  EXPECT_EQ(first.stamps, second.stamps);
}

TEST_F(Replay, FramesHoldWhatWasRecorded) {
  const std::unique_ptr<RgbdSource> source = open_and_start();
  FramePool expected_pool(kTestWidth, kTestHeight, 1);
  for (int i = 0; i < kFrames; ++i) {
    const Capture capture = source->next({});
    ASSERT_EQ(capture.kind, CaptureKind::Frame);
    FrameWriter expected = *expected_pool.acquire();
    paint(*expected, i);
    ASSERT_EQ(std::memcmp(capture.frame->bgr.row(7), expected->bgr.row(7), 3 * kTestWidth), 0);
    ASSERT_EQ(std::memcmp(capture.frame->depth_m.row(7), expected->depth_m.row(7), sizeof(float) * kTestWidth), 0);
  }
}

TEST_F(Replay, TheEndStaysTheEnd) {
  const std::unique_ptr<RgbdSource> source = open_and_start();
  play(*source);
  EXPECT_EQ(source->next({}).kind, CaptureKind::EndOfStream);
  EXPECT_EQ(pool_.free_slots(), pool_.slots());
}

TEST_F(Replay, LockstepWaitsForASlotAndDropsNothing) {
  const std::unique_ptr<RgbdSource> source = open_and_start();
  std::vector<FrameRef> held;
  for (int i = 0; i < 2; ++i) {
    held.push_back(source->next({}).frame);
  }
  std::vector<FrameWriter> rest;  // everything that is left
  while (std::optional<FrameWriter> slot = pool_.acquire()) {
    rest.push_back(std::move(*slot));
  }
  std::jthread consumer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    rest.clear();
    held.clear();
  });
  EXPECT_THAT(play(*source).sequences, ElementsAre(2, 3, 4, 5));
}

TEST_F(Replay, RealtimeIsPacedByTheStamps) {
  config_.pacing = Pacing::Realtime;
  const TimeNs before_ns = clock_.now_ns();
  const Played played = play(*open_and_start());
  ASSERT_EQ(played.captures.size(), static_cast<std::size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(played.captures[static_cast<std::size_t>(i)], before_ns + i * kTestPeriodNs);
  }
  EXPECT_EQ(clock_.now_ns(), before_ns + (kFrames - 1) * kTestPeriodNs) << "no frame came before it was due, none slept longer";
}

TEST_F(Replay, ALateFrameKeepsItsDueTime) {
  config_.pacing = Pacing::Realtime;
  const std::unique_ptr<RgbdSource> source = open_and_start();
  const TimeNs start_ns = source->next({}).frame->capture_ns;
  clock_.advance(kNsPerSecond);
  EXPECT_EQ(source->next({}).frame->capture_ns, start_ns + kTestPeriodNs);
}

TEST_F(Replay, RealtimeOnTheMachinesClockNeverComesEarly) {
  config_.pacing = Pacing::Realtime;
  const Clock& clock = SystemClock::instance();
  Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config_, camera_, clock);
  ASSERT_TRUE(source);
  ASSERT_TRUE((*source)->start(pool_));
  TimeNs start_ns = 0;
  for (int i = 0; i < kFrames; ++i) {
    const Capture capture = (*source)->next({});
    ASSERT_EQ(capture.kind, CaptureKind::Frame);
    start_ns = i == 0 ? capture.frame->capture_ns : start_ns;
    EXPECT_EQ(capture.frame->capture_ns, start_ns + i * kTestPeriodNs);
    EXPECT_GE(clock.now_ns(), capture.frame->capture_ns);
  }
}

TEST_F(Replay, RealtimeLosesFramesWhileThePoolIsExhausted) {
  config_.pacing = Pacing::Realtime;
  config_.replay.decode_ahead = 1;
  FramePool small(kTestWidth, kTestHeight, 2);
  std::unique_ptr<RgbdSource> source = open();
  ASSERT_TRUE(source->start(small));
  std::vector<FrameRef> held;
  held.push_back(source->next({}).frame);
  held.push_back(source->next({}).frame);
  ASSERT_TRUE(held[0] && held[1]);
  clock_.advance(kTestPeriodNs);  // frame 2 is due, and no slot is left
  EXPECT_EQ(source->next({}).kind, CaptureKind::NoFreeSlot);
  held.clear();
  const Played rest = play(*source);
  ASSERT_FALSE(rest.sequences.empty());
  EXPECT_EQ(rest.sequences.back(), 5U);
  EXPECT_EQ(rest.sequences.size() + static_cast<std::size_t>(rest.no_slot), 3U) << "every frame is delivered or counted as lost";
  source.reset();
}

TEST_F(Replay, LoopGoesOnWithGrowingStamps) {
  config_.replay.loop = true;
  config_.pacing = Pacing::Realtime;
  const Played played = play(*open_and_start(), 2 * kFrames + 3);
  for (std::size_t i = 0; i < played.stamps.size(); ++i) {
    EXPECT_EQ(played.sequences[i], i);
    EXPECT_EQ(played.stamps[i], kTestStampNs + static_cast<std::int64_t>(i) * kTestPeriodNs) << "one period between the passes";
    EXPECT_EQ(played.captures[i] - played.captures[0], static_cast<std::int64_t>(i) * kTestPeriodNs);
  }
  const std::size_t frame_bytes = played.pixels.size() / played.stamps.size();
  EXPECT_TRUE(std::equal(played.pixels.begin(), played.pixels.begin() + static_cast<std::ptrdiff_t>(frame_bytes),
                         played.pixels.begin() + static_cast<std::ptrdiff_t>(kFrames * frame_bytes)))
      << "the second pass begins with the first frame";
}

TEST_F(Replay, BadImagesAreSkippedWithListLineAndPath) {
  truncate_file(color(0), std::filesystem::file_size(color(0)) / 2);
  std::filesystem::remove(color(1));
  truncate_file(depth(2), std::filesystem::file_size(depth(2)) - 5);
  const std::vector<std::uint8_t> gray(kTestWidth * kTestHeight, 8);
  ASSERT_TRUE(write_png_gray8(depth(3), {gray.data(), kTestWidth, kTestHeight, kTestWidth, 1}));
  ASSERT_TRUE(write_png_gray8(color(4), {gray.data(), kTestWidth, kTestHeight / 2, kTestWidth, 1}));

  const Played played = play(*open_and_start());
  EXPECT_THAT(played.sequences, ElementsAre(5)) << "bad frames leave a gap";
  const std::string rgb = (folder_.path() / "rgb.txt").string();
  const std::string depths = (folder_.path() / "depth.txt").string();
  EXPECT_THAT(played.skipped,
              ElementsAre(AllOf(HasSubstr(rgb + ":3: "), HasSubstr(color(0).string()), HasSubstr("truncated")),
                          AllOf(HasSubstr(rgb + ":4: "), HasSubstr(color(1).string()), HasSubstr("No such file")),
                          AllOf(HasSubstr(depths + ":5: "), HasSubstr(depth(2).string()), HasSubstr("truncated")),
                          AllOf(HasSubstr(depths + ":6: "), HasSubstr(depth(3).string()), HasSubstr("8 bits")),
                          AllOf(HasSubstr(rgb + ":7: "), HasSubstr(color(4).string()), HasSubstr("48x18 where 48x36"))));
  EXPECT_EQ(played.end, CaptureKind::EndOfStream);
}

TEST_F(Replay, BadLinesComeFirstAndAreCounted) {
  const std::string good = text_of(folder_.path() / "rgb.txt");
  write_text(folder_.path() / "rgb.txt", good + "nonsense\n" + stamp(2) + " rgb/again.png\n");
  const Played played = play(*open_and_start());
  EXPECT_THAT(played.skipped, ElementsAre(HasSubstr("rgb.txt:9: 1 fields"), HasSubstr("rgb.txt:10: stamp " + stamp(2))));
  EXPECT_EQ(played.sequences.size(), 6U);
}

TEST_F(Replay, UnsortedListsPlayInOrder) {
  write_text(folder_.path() / "rgb.txt", stamp(3) + " rgb/" + stamp(3) + ".png\r\n" + stamp(0) + " rgb/" + stamp(0) + ".png\r\n");
  const Played played = play(*open_and_start());
  EXPECT_THAT(played.stamps, ElementsAre(kTestStampNs, kTestStampNs + 3 * kTestPeriodNs));
  EXPECT_TRUE(played.skipped.empty());
}

TEST_F(Replay, ARecordingWithoutOneGoodFrameFails) {
  std::filesystem::remove_all(folder_.path() / "depth");
  for (const bool loop : {false, true}) {
    config_.replay.loop = loop;
    const Played played = play(*open_and_start());
    EXPECT_EQ(played.skipped.size(), 6U);
    EXPECT_EQ(played.end, CaptureKind::Failed);
    EXPECT_THAT(played.end_message, HasSubstr("not one of 6 frames"));
  }
  std::filesystem::remove_all(folder_.path() / "rgb");
  EXPECT_THAT(open_error(), HasSubstr("none of the 6 colour images can be read; the first: "));
}

TEST_F(Replay, AnotherCameraIsRefusedAndBothSizesNamed) {
  camera_.width = 640;
  camera_.height = 480;
  std::filesystem::remove(color(0));  // the next one tells
  EXPECT_THAT(open_error(), AllOf(HasSubstr("48x36"), HasSubstr("640x480"), HasSubstr("rgb.txt:4:")));
  const auto source = make_rgbd_source(config_, camera_, clock_);
  EXPECT_EQ(source.error().code, ErrorCode::InvalidArgument);
}

TEST_F(Replay, MisuseIsRefused) {
  const std::unique_ptr<RgbdSource> source = open_and_start();
  EXPECT_FALSE(source->start(pool_)) << "a second start";
  FramePool other(8, 8, 2);
  EXPECT_FALSE(open()->start(other)) << "frames of another size";
  config_.replay.decode_ahead = 0;
  EXPECT_THAT(open_error(), HasSubstr("decode_ahead"));
}

TEST_F(Replay, JpegRecordingsPlay) {
  const TemporaryFolder other;
  write_recording(other.path(), 2, ColorFormat::Jpeg);
  config_.replay.sequence = other.path().string();
  EXPECT_THAT(play(*open_and_start()).sequences, ElementsAre(0, 1));
}

TEST_F(Replay, AStopRequestEndsEveryWait) {
  config_.pacing = Pacing::Realtime;
  write_text(folder_.path() / "as.txt", "0 rgb/" + stamp(0) + ".png 0 depth/" + stamp(0) + ".png\n100000 rgb/" + stamp(1) +
                                            ".png 100000 depth/" + stamp(1) + ".png\n");
  config_.replay.associations = "as.txt";
  Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config_, camera_, SystemClock::instance());
  ASSERT_TRUE(source);
  ASSERT_TRUE((*source)->start(pool_));
  ASSERT_EQ((*source)->next(stop_.get_token()).kind, CaptureKind::Frame);
  std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    stop_.request_stop();
  });
  EXPECT_EQ((*source)->next(stop_.get_token()).kind, CaptureKind::Stopped) << "the next frame is due in a day";
  EXPECT_EQ((*source)->next(stop_.get_token()).kind, CaptureKind::Stopped);
}

TEST_F(Replay, AStopRequestEndsTheWaitForASlot) {
  std::vector<FrameWriter> all;
  while (std::optional<FrameWriter> slot = pool_.acquire()) {
    all.push_back(std::move(*slot));
  }
  std::unique_ptr<RgbdSource> source = open_and_start();
  std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    stop_.request_stop();
  });
  EXPECT_EQ(source->next(stop_.get_token()).kind, CaptureKind::Stopped);
  source.reset();  // joins a thread that waits for a slot
  all.clear();
  EXPECT_EQ(pool_.free_slots(), pool_.slots());
}

TEST_F(Replay, DestructionGivesDecodedFramesBack) {
  {
    const std::unique_ptr<RgbdSource> source = open_and_start();
    EXPECT_EQ(source->next({}).kind, CaptureKind::Frame);
  }
  EXPECT_EQ(pool_.free_slots(), pool_.slots());
}

}  // namespace
}  // namespace posed
