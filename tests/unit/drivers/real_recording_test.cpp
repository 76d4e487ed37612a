#include <gtest/gtest.h>

#include "drivers/replay_source.h"
#include "tests/support/recordings.h"

namespace posed {
namespace {

TEST(RealRecording, EveryFrameOfFreiburg1XyzIsDelivered) {
  const std::filesystem::path folder = recording_folder("tum_fr1_xyz");
  if (!std::filesystem::exists(folder / "rgb.txt")) {
    GTEST_SKIP() << "needs the recording tum_fr1_xyz; looked for " << folder << " (set POSED_TEST_DATA)";
  }
  SourceConfig config;
  config.kind = SourceKind::Replay;
  config.pacing = Pacing::Lockstep;
  config.replay.sequence = folder.string();
  Result<std::unique_ptr<RgbdSource>> source = make_rgbd_source(config, CameraIntrinsics{}, SystemClock::instance());
  ASSERT_TRUE(source) << source.error().message;
  const std::uint64_t total = (*source)->info().total_frames;
  EXPECT_EQ(total, 480U);
  EXPECT_NEAR((*source)->info().rate_hz, 30.0, 2.0);

  FramePool pool(640, 480, 8);
  ASSERT_TRUE((*source)->start(pool));
  std::int64_t last_stamp_ns = 0;
  std::uint64_t frames = 0;
  std::uint64_t pixels_with_depth = 0;
  Capture capture = (*source)->next({});
  for (; capture.kind == CaptureKind::Frame; capture = (*source)->next({})) {
    ASSERT_EQ(capture.frame->sequence, frames++);
    ASSERT_GT(capture.frame->stamp_utc_ns, last_stamp_ns);
    last_stamp_ns = capture.frame->stamp_utc_ns;
    for (int x = 0; x < 640; ++x) {
      const float depth_m = capture.frame->depth_m.at(x, 240);
      ASSERT_TRUE(depth_m == 0.0F || (depth_m > 0.3F && depth_m < 10.0F)) << depth_m;
      pixels_with_depth += depth_m > 0.0F ? 1 : 0;
    }
  }
  EXPECT_EQ(capture.kind, CaptureKind::EndOfStream) << capture.error.message;
  EXPECT_EQ(frames, total);
  EXPECT_GT(pixels_with_depth, frames * 640 / 2);
}

}  // namespace
}  // namespace posed
