#include "tools/posectl/synth_recording.h"

#include <filesystem>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "tests/support/temporary_folder.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/trajectory.h"

namespace posed {
namespace {

using testing::HasSubstr;

SynthRequest request_in(const std::filesystem::path& folder) {
  SynthRequest request;
  request.folder = folder;
  request.camera = primesense_camera(160, 120);
  request.frames = 3;
  return request;
}

TEST(PrimesenseCamera, KeepsTheFieldOfView) {
  const CameraIntrinsics camera = primesense_camera(320, 240);
  EXPECT_DOUBLE_EQ(camera.fx, 262.5);
  EXPECT_DOUBLE_EQ(camera.fy, 262.5);
  EXPECT_DOUBLE_EQ(camera.cx, 159.5);
  EXPECT_DOUBLE_EQ(camera.cy, 119.5);
  EXPECT_DOUBLE_EQ(camera.baseline_fx, 20.0);
}

TEST(FormatCamera, IsReadBackByTheLoader) {
  const TemporaryFolder folder;
  CameraIntrinsics camera = primesense_camera(640, 480);
  camera.k1 = -0.123456789012345;
  camera.depth_delay_s = -0.016;
  const Result<CameraIntrinsics> read = load_camera(folder.write("camera.toml", format_camera(camera, "Two\nlines.")));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->width, 640);
  EXPECT_EQ(read->fx, camera.fx);
  EXPECT_EQ(read->cy, camera.cy);
  EXPECT_EQ(read->k1, camera.k1);
  EXPECT_EQ(read->baseline_fx, camera.baseline_fx);
  EXPECT_EQ(read->depth_delay_s, camera.depth_delay_s);
}

TEST(SynthRecording, RefusesAFolderThatIsNotEmpty) {
  const TemporaryFolder folder;
  folder.write("precious.txt", "mine");
  const Status status = prepare_recording_folder(request_in(folder.path()));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(status.error().message, HasSubstr("--force"));
}

TEST(SynthRecording, ReplacesARecordingAndNothingElse) {
  const TemporaryFolder folder;
  folder.write("precious.txt", "mine");
  folder.write("rgb.txt", "old");
  SynthRequest request = request_in(folder.path());
  request.replace = true;
  ASSERT_TRUE(prepare_recording_folder(request));
  EXPECT_EQ(contents_of(folder / "precious.txt"), "mine");
  EXPECT_FALSE(std::filesystem::exists(folder / "rgb.txt"));
}

TEST(SynthRecording, ChecksTheFreeSpaceFirst) {
  const TemporaryFolder folder;
  SynthRequest request = request_in(folder.path());
  request.frames = std::numeric_limits<std::uint64_t>::max() / (160 * 120 * 6);
  const Status status = prepare_recording_folder(request);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_THAT(status.error().message, HasSubstr("MB free"));
}

TEST(SynthRecording, StopsWithWholeListsWhenAskedTo) {
  const TemporaryFolder folder;
  const SynthRequest request = request_in(folder.path());
  ASSERT_TRUE(prepare_recording_folder(request));
  const Result<std::uint64_t> written = write_synthetic_recording(request, [](std::uint64_t done) { return done < 2; });
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(*written, 2u);
  const Result<Trajectory> truth = read_trajectory(folder / "groundtruth.txt");
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_EQ(truth->size(), 2u);
  EXPECT_EQ(read_frame_stamps(folder / "rgb.txt")->size(), 2u);
  for (const std::filesystem::directory_entry& image : std::filesystem::directory_iterator(folder / "rgb")) {
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "masks" / image.path().filename())) << image.path();
  }
}

}  // namespace
}  // namespace posed
