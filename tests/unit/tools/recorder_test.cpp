#include "tools/posectl/recorder.h"

#include <atomic>
#include <csignal>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <posed/rgbd_frame_t.hpp>
#include <sys/mount.h>
#include <sys/wait.h>

#include "drivers/image_file.h"
#include "drivers/tum_sequence.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/painted_source.h"
#include "tools/posectl/camera_text.h"

namespace posed {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr TimeNs kPatience_ns = 60 * kNsPerSecond;

CameraIntrinsics test_camera() {
  CameraIntrinsics camera;
  camera.width = kTestWidth;
  camera.height = kTestHeight;
  return camera;
}

std::vector<std::unique_ptr<FrameSink>> tum_sink(const std::filesystem::path& folder) {
  std::vector<std::unique_ptr<FrameSink>> sinks;
  sinks.push_back(make_tum_sink(folder, {}, format_camera(test_camera(), "Test.")).value());
  return sinks;
}

/// What a recording holds, each image decoded.
struct Readable {
  std::size_t frames = 0;
  std::size_t skipped_lines = 0;
};

Readable read_recording(const std::filesystem::path& folder) {
  ReplayConfig config;
  config.sequence = folder.string();
  config.max_stamp_difference_s = 0;
  Readable readable;
  const Result<TumSequence> sequence = load_tum_sequence(config);
  if (!sequence) {
    return readable;
  }
  readable.skipped_lines = sequence->skipped_lines.size();
  EXPECT_EQ(sequence->unpaired, 0U);
  FramePool pool(kTestWidth, kTestHeight, 1);
  FrameWriter frame = *pool.acquire();
  ImageDecoder decoder;
  for (const TumAssociation& pair : sequence->pairs) {
    const Status color = decoder.read_color(folder / pair.color.image, frame->bgr, frame->gray);
    const Status depth = decoder.read_depth(folder / pair.depth.image, 5000.0, frame->depth_m);
    if (!color && pair.color.stamp_ns == sequence->pairs.back().color.stamp_ns && readable.skipped_lines == 0) {
      continue;  // the torn last line
    }
    EXPECT_TRUE(color && depth) << (color ? depth : color).error().message;
    ++readable.frames;
  }
  return readable;
}

/// Keeps the numbers of the frames, and is as slow as the test wants.
class GatedSink final : public FrameSink {
 public:
  struct State {
    std::atomic<bool> open{true};
    std::atomic<std::uint64_t> waiting{0};
    std::vector<std::uint64_t> added;
    std::uint64_t committed = 0;
    std::uint64_t fail_at = ~std::uint64_t{0};
  };
  explicit GatedSink(State& state) : state_(state) {}

  Status add(const EncodedFrame& frame) override {
    ++state_.waiting;
    while (!state_.open) {
      SystemClock::instance().sleep_until(SystemClock::instance().now_ns() + kNsPerMs);
    }
    if (state_.added.size() == state_.fail_at) {
      return make_error(ErrorCode::Io, "the sink is full");
    }
    state_.added.push_back(frame.sequence);
    return {};
  }
  Status commit() override {
    state_.committed = state_.added.size();
    return {};
  }

 private:
  State& state_;
};

std::vector<std::unique_ptr<FrameSink>> gated(GatedSink::State& state) {
  std::vector<std::unique_ptr<FrameSink>> sinks;
  sinks.push_back(std::make_unique<GatedSink>(state));
  return sinks;
}

TEST(Recorder, KeepsTheOrderOverSeveralEncoders) {
  GatedSink::State state;
  SourceErrors errors;
  RecorderOptions options;
  options.encoders = 3;
  options.queue = 4;
  Recorder recorder(std::make_unique<PaintedSource>(50), gated(state), options, errors, SystemClock::instance());
  recorder.start();
  ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  EXPECT_TRUE(recorder.status());
  ASSERT_EQ(state.added.size(), 50U);
  for (std::size_t i = 0; i < state.added.size(); ++i) {
    EXPECT_EQ(state.added[i], i);
  }
  EXPECT_EQ(recorder.report().committed, 50U);
  EXPECT_EQ(recorder.report().dropped, 0U);
}

TEST(Recorder, OneFrameAtATimeIsEnough) {
  GatedSink::State state;
  SourceErrors errors;
  RecorderOptions options;
  options.queue = 1;
  Recorder recorder(std::make_unique<PaintedSource>(500), gated(state), options, errors, SystemClock::instance());
  recorder.start();
  ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  EXPECT_EQ(recorder.report().committed, 500U);
}

TEST(Recorder, CountsWhatASlowWriterDropsAndKeepsTheRest) {
  GatedSink::State state;
  state.open = false;
  SourceErrors errors;
  RecorderOptions options;
  options.queue = 4;
  Recorder recorder(std::make_unique<PaintedSource>(2000, Pacing::Realtime), gated(state), options, errors,
                    SystemClock::instance());
  recorder.start();
  const Clock& clock = SystemClock::instance();
  const TimeNs give_up_ns = clock.now_ns() + kPatience_ns;
  while (recorder.report().captured + recorder.report().dropped < 2000 && clock.now_ns() < give_up_ns) {
    clock.sleep_until(clock.now_ns() + kNsPerMs);
  }
  state.open = true;
  ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  const RecorderReport report = recorder.report();
  EXPECT_GT(report.dropped, 1900U) << "at most twice the queue fits between the source and a writer that stands still";
  EXPECT_EQ(report.captured + report.dropped, 2000U);
  EXPECT_EQ(report.committed, report.captured);
  EXPECT_EQ(state.added.size(), report.captured);
  EXPECT_EQ(report.missed, 0U) << "a drop of ours is not the source's";
}

TEST(Recorder, ASinkThatFailsEndsItWithEverythingBeforeKept) {
  GatedSink::State state;
  state.fail_at = 7;
  SourceErrors errors;
  Recorder recorder(std::make_unique<PaintedSource>(0), gated(state), {}, errors, SystemClock::instance());
  recorder.start();
  ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  ASSERT_FALSE(recorder.status());
  EXPECT_EQ(recorder.status().error().message, "the sink is full");
  EXPECT_EQ(state.committed, 7U);
  EXPECT_EQ(recorder.report().committed, 7U);
  EXPECT_GT(recorder.report().captured, 7U);
}

TEST(Recorder, EndsAtItsLimits) {
  for (const bool by_frames : {true, false}) {
    GatedSink::State state;
    SourceErrors errors;
    RecorderOptions options;
    (by_frames ? options.max_frames = 12 : options.max_frames = 0);
    options.max_duration_ns = by_frames ? 0 : 12 * kTestPeriodNs;
    Recorder recorder(std::make_unique<PaintedSource>(0), gated(state), options, errors, SystemClock::instance());
    recorder.start();
    ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
    EXPECT_EQ(recorder.report().committed, 12U) << by_frames;
  }
}

TEST(Recorder, StopsWhenAskedToAndWritesWhatItHas) {
  const TemporaryFolder folder;
  SourceErrors errors;
  Recorder recorder(std::make_unique<PaintedSource>(0), tum_sink(folder.path() / "new"), {}, errors, SystemClock::instance());
  recorder.start();
  while (recorder.report().captured < 20) {
    SystemClock::instance().sleep_until(SystemClock::instance().now_ns() + kNsPerMs);
  }
  recorder.request_stop();
  ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  EXPECT_EQ(recorder.report().committed, recorder.report().captured);
  EXPECT_EQ(read_recording(folder.path() / "new").frames, recorder.report().committed);
}

/// The child records and tells the number of committed frames until it is killed.
void record_until_killed(const std::filesystem::path& folder, int report_fd) {
  SourceErrors errors;
  RecorderOptions options;
  options.commit_period_ns = 2 * kNsPerMs;
  Recorder recorder(std::make_unique<PaintedSource>(0), tum_sink(folder), options, errors, SystemClock::instance());
  recorder.start();
  while (!recorder.wait_finished(kNsPerMs)) {
    const std::uint64_t committed = recorder.report().committed;
    if (::write(report_fd, &committed, sizeof committed) != sizeof committed) {
      break;
    }
  }
  ::_exit(1);
}

TEST(Recorder, AKillTakesNoFrameThatWasReported) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> moment_us(0, 60'000);
  std::uint64_t most = 0;
  for (int round = 0; round < 12; ++round) {
    const TemporaryFolder folder;
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(ends[0]);
      record_until_killed(folder.path(), ends[1]);
    }
    ::close(ends[1]);
    std::uint64_t reported = 0;
    while (reported < 5 && ::read(ends[0], &reported, sizeof reported) == sizeof reported) {
    }
    ::usleep(static_cast<useconds_t>(moment_us(random)));
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    while (::read(ends[0], &reported, sizeof reported) == sizeof reported) {  // what it told until then
    }
    ::close(ends[0]);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child failed by itself";
    EXPECT_GE(reported, 5U);
    EXPECT_GE(read_recording(folder.path()).frames, reported) << "round " << round;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "camera.toml"));
    most = std::max(most, reported);
  }
  EXPECT_GT(most, 5U);
}

TEST(Recorder, ATornLastLineCostsThatFrameAlone) {
  const TemporaryFolder folder;
  write_recording(folder.path(), 3);
  const std::string whole = text_of(folder.path() / "rgb.txt");
  const std::size_t last_line = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t bytes = last_line; bytes < whole.size(); ++bytes) {
    write_text(folder.path() / "rgb.txt", whole.substr(0, bytes));
    const std::size_t expected = bytes == whole.size() - 1 ? 3 : 2;  // but for its end, the line is whole
    EXPECT_EQ(read_recording(folder.path()).frames, expected) << whole.substr(last_line, bytes - last_line);
  }
}

/// A limit of the file size refuses to write on in the middle of a file, as a full disk does.
TEST(Recorder, ADiskThatRefusesKeepsWhatWasWritten) {
  const TemporaryFolder folder;
  SourceErrors errors;
  std::vector<std::unique_ptr<FrameSink>> sinks = tum_sink(folder.path() / "tum");
  sinks.push_back(make_lcm_log_sink(folder.path() / "frames.log", "T_FRAME", test_camera()).value());
  RecorderOptions options;
  options.commit_period_ns = 0;
  Recorder recorder(std::make_unique<PaintedSource>(0), std::move(sinks), options, errors, SystemClock::instance());
  {
    const FileSizeLimit limit(60'000);  // ten frames or so of the log
    recorder.start();
    ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
  }
  ASSERT_FALSE(recorder.status());
  EXPECT_THAT(recorder.status().error().message, HasSubstr("frames.log"));
  EXPECT_GE(recorder.report().committed, 3U);
  EXPECT_GE(read_recording(folder.path() / "tum").frames, recorder.report().committed);
  lcm::LogFile log(folder / "frames.log", "r");
  std::uint64_t events = 0;
  while (log.readNextEvent() != nullptr) {
    ++events;
  }
  EXPECT_GE(events, recorder.report().committed);
}

TEST(Recorder, AFullDiskKeepsWhatWasWritten) {
  const TemporaryFolder folder;
  if (::mount("none", folder.path().c_str(), "tmpfs", 0, "size=400k") != 0) {
    GTEST_SKIP() << "this process may not mount a file system";
  }
  SourceErrors errors;
  RecorderOptions options;
  options.commit_period_ns = 0;
  {
    Recorder recorder(std::make_unique<PaintedSource>(0), tum_sink(folder.path() / "tum"), options, errors,
                      SystemClock::instance());
    recorder.start();
    ASSERT_TRUE(recorder.wait_finished(kPatience_ns));
    EXPECT_FALSE(recorder.status());
    EXPECT_THAT(recorder.status().error().message, HasSubstr("free some space"));
    EXPECT_GE(recorder.report().committed, 10U);
    EXPECT_GE(read_recording(folder.path() / "tum").frames, recorder.report().committed);
  }
  ::umount(folder.path().c_str());
}

TEST(FrameSink, RefusesWhatIsThereAlready) {
  const TemporaryFolder folder;
  write_recording(folder.path() / "recording", 1);
  EXPECT_EQ(make_tum_sink(folder.path() / "recording", {}, "x").error().code, ErrorCode::InvalidArgument);
  folder.write("calibrated/camera.toml", "mine");
  EXPECT_EQ(make_tum_sink(folder.path() / "calibrated", {}, "x").error().code, ErrorCode::InvalidArgument);
  folder.write("frames.log", "mine");
  EXPECT_EQ(make_lcm_log_sink(folder.path() / "frames.log", "C", test_camera()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(text_of(folder.path() / "frames.log"), "mine");
  EXPECT_EQ(make_lcm_log_sink(folder.path() / "none" / "frames.log", "C", test_camera()).error().code, ErrorCode::NotFound);
}

TEST(FrameSink, TheLcmLogHoldsTheVeryImagesAndATornTailIsSkipped) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "frames.log";
  FramePool pool(kTestWidth, kTestHeight, 1);
  FrameWriter frame = *pool.acquire();
  std::vector<EncodedFrame> frames(2);
  {
    const std::unique_ptr<FrameSink> sink = make_lcm_log_sink(path, "T_FRAME", test_camera()).value();
    for (int i = 0; i < 2; ++i) {
      EncodedFrame& encoded = frames[static_cast<std::size_t>(i)];
      paint(*frame, i);
      frame->sequence = static_cast<std::uint64_t>(40 + i);
      frame->stamp_utc_ns = kTestStampNs + i * kTestPeriodNs;
      ASSERT_TRUE(encode_frame(*frame, {.color_format = i == 0 ? ColorFormat::Png : ColorFormat::Jpeg}, encoded));
      ASSERT_TRUE(sink->add(encoded));
    }
    ASSERT_TRUE(sink->commit());
    lcm::LogFile log(path.string(), "r");  // while it is still being written
    for (int i = 0; i < 2; ++i) {
      const lcm::LogEvent* event = log.readNextEvent();
      ASSERT_NE(event, nullptr);
      EXPECT_EQ(event->channel, "T_FRAME");
      rgbd_frame_t message;
      ASSERT_GT(message.decode(event->data, 0, event->datalen), 0);
      EXPECT_EQ(message.utime, (kTestStampNs + i * kTestPeriodNs) / 1000);
      EXPECT_EQ(message.sequence, 40 + i);
      EXPECT_EQ(message.width, kTestWidth);
      EXPECT_EQ(message.depth_units_per_metre, 5000.0);
      EXPECT_EQ(message.color_format, i == 0 ? rgbd_frame_t::COLOR_PNG : rgbd_frame_t::COLOR_JPEG);
      EXPECT_EQ(message.color, frames[static_cast<std::size_t>(i)].color);
      EXPECT_EQ(message.depth, frames[static_cast<std::size_t>(i)].depth);
    }
    EXPECT_EQ(log.readNextEvent(), nullptr);
  }
  const std::uintmax_t whole = std::filesystem::file_size(path);
  const std::uintmax_t last_event = 28 + std::string("T_FRAME").size();  // its header; the message is longer
  for (const std::uintmax_t cut : {std::uintmax_t{1}, std::uintmax_t{100}, frames[1].depth.size() + std::uintmax_t{20}}) {
    truncate_file(path, whole - cut);
    ASSERT_GT(std::filesystem::file_size(path), last_event);
    lcm::LogFile log(path.string(), "r");
    EXPECT_NE(log.readNextEvent(), nullptr);
    EXPECT_EQ(log.readNextEvent(), nullptr) << "cut by " << cut;
  }
}

}  // namespace
}  // namespace posed
