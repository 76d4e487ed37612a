#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "config/config_loader.h"
#include "core/clock.h"
#include "drivers/rgbd_source.h"
#include "tests/support/test_recording.h"
#include "tests/unit/tools/posectl_outcome.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/exit_code.h"

namespace posed {
namespace {

using testing::HasSubstr;

constexpr const char* kSmallCamera =
    "[camera]\nwidth = 160\nheight = 120\nfx = 131.0\nfy = 131.0\ncx = 79.5\ncy = 59.5\ndistortion = [0.1, 0.0, 0.0, 0.0, 0.0]\n"
    "depth_units_per_metre = 1000.0\nbaseline_fx = 10.0\n";

/// A configuration whose source is `source`, with a small camera.
std::string config_with(const TemporaryFolder& folder, const std::string& name, const std::string& source) {
  folder.write("small.toml", kSmallCamera);
  return folder.write(name, "[camera]\ncalibration = \"small.toml\"\n" + source);
}

std::string synthetic_config(const TemporaryFolder& folder, const std::string& pacing = "lockstep") {
  return config_with(folder, "synthetic.toml",
                     "[tracker]\npyramid_levels = 4\n[source]\nkind = \"synthetic\"\npacing = \"" + pacing +
                         "\"\n[source.synthetic]\npeople = 0\nduration_s = 1000.0\n");
}

/// All frames of the source of `config`, in lockstep.
template <typename Look>
void for_each_frame(const Config& config, std::size_t frames, Look&& look) {
  FramePool pool(config.intrinsics.width, config.intrinsics.height, 16);
  const Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config.source, config.intrinsics, SystemClock::instance());
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_TRUE((*source)->start(pool));
  for (std::size_t i = 0; i < frames; ++i) {
    const Capture capture = (*source)->next({});
    ASSERT_EQ(capture.kind, CaptureKind::Frame) << i << ": " << capture.error.message;
    look(i, *capture.frame);
  }
}

TEST(PosectlRecord, ReplaysWhatTheSourceDeliveredBitByBit) {
  constexpr std::size_t kFrames = 6;
  const TemporaryFolder folder;
  const std::string synthetic = synthetic_config(folder);
  const std::string recorded = folder / "recorded";
  const Outcome outcome =
      posectl({"record", "--config", synthetic, "-o", recorded, "--frames", "6", "--encoders", "2", "--min-free", "1"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("6 frames of 160x120 written, 0 dropped"));
  EXPECT_THAT(outcome.out, HasSubstr("posectl replay --sequence '" + recorded + "' --camera '" + recorded + "/camera.toml'"));

  struct Pixels {
    std::vector<std::uint8_t> bgr;
    std::vector<float> depth_m;
    std::int64_t stamp_utc_ns = 0;
  };
  const auto pixels_of = [](const RgbdFrame& frame) {
    Pixels pixels;
    for (int y = 0; y < frame.bgr.height; ++y) {
      pixels.bgr.insert(pixels.bgr.end(), frame.bgr.row(y), frame.bgr.row(y) + 3 * frame.bgr.width);
      pixels.depth_m.insert(pixels.depth_m.end(), frame.depth_m.row(y), frame.depth_m.row(y) + frame.depth_m.width);
    }
    pixels.stamp_utc_ns = frame.stamp_utc_ns;
    return pixels;
  };
  std::vector<Pixels> delivered;
  const Config config = load_config(synthetic).value();
  for_each_frame(config, kFrames, [&](std::size_t, const RgbdFrame& frame) { delivered.push_back(pixels_of(frame)); });

  Config replay = config;
  replay.intrinsics = load_camera(recorded + "/camera.toml").value();
  EXPECT_EQ(replay.intrinsics.k1, config.intrinsics.k1);
  EXPECT_EQ(replay.intrinsics.depth_units_per_metre, 1000.0);
  replay.source.kind = SourceKind::Replay;
  replay.source.replay.sequence = recorded;
  std::int64_t last_stamp_ns = 0;
  for_each_frame(replay, kFrames, [&](std::size_t i, const RgbdFrame& frame) {
    const Pixels replayed = pixels_of(frame);
    EXPECT_EQ(replayed.bgr, delivered[i].bgr) << "frame " << i;
    float largest_m = 0;
    for (std::size_t k = 0; k < replayed.depth_m.size(); ++k) {
      largest_m = std::max(largest_m, std::abs(replayed.depth_m[k] - delivered[i].depth_m[k]));
    }
    EXPECT_LE(largest_m, 0.00051F) << "half of a unit of the calibration";
    EXPECT_GT(replayed.stamp_utc_ns, last_stamp_ns);
    last_stamp_ns = replayed.stamp_utc_ns;
  });

  // A recording of the recording is the same to the last byte.
  folder.write("again.toml",
               "[camera]\ncalibration = \"recorded/camera.toml\"\n[tracker]\npyramid_levels = 4\n[source]\nkind = "
               "\"replay\"\npacing = \"lockstep\"\n[source.replay]\nsequence = \"recorded\"\n");
  const Outcome again = posectl({"record", "--config", folder / "again.toml", folder / "again", "--min-free", "1"});
  ASSERT_EQ(again.exit_code, kExitOk) << again.err;
  EXPECT_EQ(text_of(folder / "again/rgb.txt"), text_of(recorded + "/rgb.txt"));
  EXPECT_EQ(text_of(folder / "again/depth.txt"), text_of(recorded + "/depth.txt"));
  std::size_t images = 0;
  for (const char* kind : {"rgb", "depth"}) {
    for (const auto& image : std::filesystem::directory_iterator(std::filesystem::path(recorded) / kind)) {
      EXPECT_EQ(bytes_of(folder.path() / "again" / kind / image.path().filename()), bytes_of(image.path()));
      ++images;
    }
  }
  EXPECT_EQ(images, 2 * kFrames);
}

TEST(PosectlRecord, WritesJpegAndAnLcmLog) {
  const TemporaryFolder folder;
  const Outcome outcome = posectl({"record", "--config", synthetic_config(folder), folder / "recorded", "--frames", "3", "--jpeg",
                                   "--lcm-log", folder / "frames.log", "--min-free", "1"});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(text_of(folder / "recorded/rgb.txt"), HasSubstr(".jpg\n"));
  lcm::LogFile log(folder / "frames.log", "r");
  for (int i = 0; i < 3; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->channel, "POSED_FRAME");
  }
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST(PosectlRecord, EndsOrderlyAtASignal) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    const std::string config = synthetic_config(folder);
    std::jthread user([&](const std::stop_token& stop) {
      while (!stop.stop_requested() && !std::filesystem::exists(folder / "recorded/rgb.txt")) {
        SystemClock::instance().sleep_until(SystemClock::instance().now_ns() + kNsPerMs);
      }
      ::kill(::getpid(), stop.stop_requested() ? 0 : signal);
    });
    const Outcome outcome = posectl({"record", "--config", config, folder / "recorded", "--min-free", "1"});
    EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("posectl replay"));
    EXPECT_TRUE(text_of(folder / "recorded/rgb.txt").ends_with("\n"));
  }
}

TEST(PosectlRecord, RefusesBeforeItBegins) {
  const TemporaryFolder folder;
  const std::string config = synthetic_config(folder);
  folder.write("old/rgb.txt", "mine");
  EXPECT_EQ(posectl({"record", "--config", config, folder / "old", "--min-free", "1"}).exit_code, kExitUsage);
  EXPECT_EQ(text_of(folder / "old/rgb.txt"), "mine");
  EXPECT_EQ(posectl({"record"}).exit_code, kExitUsage);
  EXPECT_EQ(posectl({"record", "--config", folder / "none.toml", folder / "new"}).exit_code, kExitNoInput);
  EXPECT_EQ(posectl({"record", "--config", folder.write("wrong.toml", "x = 1\n"), folder / "new"}).exit_code, kExitConfig);
  const Outcome full = posectl({"record", "--config", config, folder / "new", "--min-free", "1000TB"});
  EXPECT_EQ(full.exit_code, kExitIo);
  EXPECT_THAT(full.err, HasSubstr("MB free"));
  EXPECT_FALSE(std::filesystem::exists(folder / "new/rgb.txt"));
}

}  // namespace
}  // namespace posed
