#include "drivers/openni2/openni2_source.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "tests/unit/drivers/openni2/openni2_rig.h"

namespace posed::test {
namespace {

using testing::HasSubstr;

const Clock& kClock = SystemClock::instance();

using OpenNi2SourceTest = OpenNi2Test;

/// The reason why the camera cannot be opened.
std::string refusal(const SourceConfig& config, const std::string& uri = "fake/0") {
  Running running(config, kClock);
  const Capture capture = running.open(uri);
  EXPECT_EQ(capture.kind, CaptureKind::Interrupted);
  const FakeOpenNi2State state = fake_openni2().state(uri);
  EXPECT_EQ(state.streams, 0);
  EXPECT_EQ(state.times_opened, state.times_closed);
  EXPECT_FALSE(state.color_runs || state.depth_runs);
  return capture.error.message;
}

TEST_F(OpenNi2SourceTest, DeliversEachPixelAsTheCameraSawIt) {
  fake_openni2().plug(fake_camera());
  Running running(openni2_config(), kClock);
  running.open();
  for (int i = 1; i <= 3; ++i) {
    const TimeNs before_ns = kClock.now_ns();
    ASSERT_TRUE(push_pair(1000 * static_cast<std::uint64_t>(i), i));
    const Capture capture = running.next();
    ASSERT_EQ(capture.kind, CaptureKind::Frame) << capture.error.message;
    EXPECT_TRUE(shows(*capture.frame, i));
    EXPECT_EQ(capture.frame->sequence, static_cast<std::uint64_t>(i - 1));
    EXPECT_LE(capture.frame->capture_ns, kClock.now_ns());
    EXPECT_GT(capture.frame->capture_ns, before_ns - kNsPerSecond);
  }
  EXPECT_TRUE(running.health().connected);
  EXPECT_EQ(running.health().unpaired, 0U);
}

TEST_F(OpenNi2SourceTest, TellsTheCameraWhatItNeeds) {
  for (const bool automatic : {true, false}) {
    fake_openni2().plug(fake_camera());
    SourceConfig config = openni2_config();
    config.openni2.auto_exposure = automatic;
    config.openni2.auto_white_balance = !automatic;
    config.openni2.frame_sync = automatic;
    Running running(config, kClock);
    running.open();
    const FakeOpenNi2State state = fake_openni2().state("fake/0");
    EXPECT_EQ(state.registration, ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR);
    EXPECT_EQ(state.synced_streams, automatic ? 2 : 0) << "each round ends with the streams told apart";
    EXPECT_FALSE(state.color_mirrored);
    EXPECT_FALSE(state.depth_mirrored);
    EXPECT_EQ(state.auto_exposure, automatic);
    EXPECT_EQ(state.auto_white_balance, !automatic);
  }
}

TEST_F(OpenNi2SourceTest, TurnsWhatTheCameraMirrors) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.can_unmirror = false;
  fake_openni2().plug(camera);
  Running running(openni2_config(), kClock);
  running.open();
  push_pair(1000, 1);
  const Capture capture = running.next();
  ASSERT_EQ(capture.kind, CaptureKind::Frame);
  for (int x = 0; x < kWidth; ++x) {
    const std::uint8_t* bgr = &capture.frame->bgr.at(x, 5);
    EXPECT_EQ(bgr[0], test_color(kWidth - 1 - x, 5, 2, 1));
    EXPECT_EQ(bgr[2], test_color(kWidth - 1 - x, 5, 0, 1));
    EXPECT_FLOAT_EQ(capture.frame->depth_m.at(x, 5), static_cast<float>(test_depth(kWidth - 1 - x, 5, 1)) / 1000.0F);
  }
}

/// BT.601 with the studio's range, in floating point.
std::array<double, 3> rgb_of_yuv(double y, double u, double v) {
  const double luma = (y - 16) / 219;
  const double pb = (u - 128) / 224;
  const double pr = (v - 128) / 224;
  const auto clip = [](double c) { return std::clamp(255 * c, 0.0, 255.0); };
  return {clip(luma + 1.402 * pr), clip(luma - 0.344136 * pb - 0.714136 * pr), clip(luma + 1.772 * pb)};
}

TEST_F(OpenNi2SourceTest, ConvertsYuv) {
  for (const OniPixelFormat format : {ONI_PIXEL_FORMAT_YUYV, ONI_PIXEL_FORMAT_YUV422}) {
    FakeOpenNi2Camera camera = fake_camera();
    camera.color_modes = {fake_mode(format)};
    fake_openni2().plug(camera);
    Running running(openni2_config(), kClock);
    running.open();
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(2 * kWidth * kHeight));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = static_cast<std::uint8_t>(i * 37 + i / 256 * 11);
    }
    ASSERT_TRUE(fake_openni2().push("fake/0", ONI_SENSOR_COLOR,
                                    {pixels.data(), static_cast<int>(pixels.size()), 2 * kWidth, kWidth, kHeight, 1000, 1}));
    push_depth(1000, 1);
    const Capture capture = running.next();
    ASSERT_EQ(capture.kind, CaptureKind::Frame) << capture.error.message;
    const int first_y = format == ONI_PIXEL_FORMAT_YUYV ? 0 : 1;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const std::uint8_t* pair = &pixels[static_cast<std::size_t>(2 * (y * kWidth + x - x % 2))];
        const auto rgb = rgb_of_yuv(pair[first_y + 2 * (x % 2)], pair[1 - first_y], pair[3 - first_y]);
        const std::uint8_t* bgr = &capture.frame->bgr.at(x, y);
        for (std::size_t i = 0; i < 3; ++i) {
          ASSERT_NEAR(bgr[2 - i], rgb[i], 0.51) << "pixel " << x << ", " << y << ", channel " << i;
        }
      }
    }
  }
}

TEST_F(OpenNi2SourceTest, ConvertsGreyAndTenthsOfMillimetres) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.color_modes = {fake_mode(ONI_PIXEL_FORMAT_GRAY8)};
  camera.depth_modes = {fake_mode(ONI_PIXEL_FORMAT_DEPTH_100_UM)};
  fake_openni2().plug(camera);
  Running running(openni2_config(), kClock);
  running.open();
  std::vector<std::uint8_t> gray(kWidth * kHeight);
  for (std::size_t i = 0; i < gray.size(); ++i) {
    gray[i] = static_cast<std::uint8_t>(i * 3);
  }
  fake_openni2().push("fake/0", ONI_SENSOR_COLOR, {gray.data(), static_cast<int>(gray.size()), kWidth, kWidth, kHeight, 1000, 1});
  push_depth(1000, 1);
  const Capture capture = running.next();
  ASSERT_EQ(capture.kind, CaptureKind::Frame) << capture.error.message;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const int x = i % kWidth;
    const int y = i / kWidth;
    EXPECT_EQ(capture.frame->gray.at(x, y), gray[static_cast<std::size_t>(i)]);
    EXPECT_EQ((&capture.frame->bgr.at(x, y))[1], gray[static_cast<std::size_t>(i)]);
    EXPECT_EQ(capture.frame->depth_m.at(x, y), static_cast<float>(test_depth(x, y, 1)) / 10'000.0F);
  }
}

TEST_F(OpenNi2SourceTest, TakesTheNextModeWhereOneIsRefused) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.color_modes = {fake_mode(ONI_PIXEL_FORMAT_YUV422), fake_mode(ONI_PIXEL_FORMAT_RGB888)};
  camera.refused_formats = {ONI_PIXEL_FORMAT_RGB888};
  fake_openni2().plug(camera);
  Running running(openni2_config(), kClock);
  running.open();
  EXPECT_EQ(fake_openni2().state("fake/0").color_mode.pixelFormat, ONI_PIXEL_FORMAT_YUV422);
}

TEST_F(OpenNi2SourceTest, SaysWhatTheCameraCannotDo) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.refused_formats = {ONI_PIXEL_FORMAT_DEPTH_1_MM};
  fake_openni2().plug(camera);
  EXPECT_THAT(refusal(openni2_config()), HasSubstr("refuses every mode of depth that it offers; 64x48 depth_1_mm at 30 Hz"));

  camera = fake_camera();
  camera.color_modes = {fake_mode(ONI_PIXEL_FORMAT_RGB888, 320, 240), fake_mode(ONI_PIXEL_FORMAT_JPEG)};
  fake_openni2().plug(camera);
  EXPECT_THAT(refusal(openni2_config()),
              HasSubstr("no colour of the calibration's size, 64x48, in a format known here; it offers 320x240 rgb888 at 30 Hz, "
                        "64x48 jpeg at 30 Hz"));

  camera = fake_camera();
  camera.color_modes.clear();
  fake_openni2().plug(camera);
  EXPECT_THAT(refusal(openni2_config()), HasSubstr("'fake/0' has no colour stream"));

  camera = fake_camera();
  camera.can_register = false;
  fake_openni2().plug(camera);
  EXPECT_THAT(refusal(openni2_config()), HasSubstr("'fake/0' cannot register depth to colour"));

  SourceConfig config = openni2_config();
  config.openni2.registration = false;
  Running running(config, kClock);
  EXPECT_EQ(running.open().kind, CaptureKind::Stopped);
  EXPECT_EQ(fake_openni2().state("fake/0").registration, ONI_IMAGE_REGISTRATION_OFF);
}

TEST_F(OpenNi2SourceTest, OpensTheCameraThatIsNamed) {
  FakeOpenNi2Camera other = fake_camera();
  other.uri = "fake/1";
  other.serial = "F0002";
  fake_openni2().plug(fake_camera());
  fake_openni2().plug(other);
  const auto opened_by = [](const std::string& device, const std::string& uri) {
    SourceConfig config = openni2_config();
    config.openni2.device = device;
    Running running(config, kClock);
    running.open(uri);
    return fake_openni2().state(uri).color_runs;
  };
  EXPECT_TRUE(opened_by("", "fake/0"));
  EXPECT_TRUE(opened_by("fake/1", "fake/1"));
  EXPECT_TRUE(opened_by("serial:F0002", "fake/1"));
  EXPECT_FALSE(fake_openni2().state("fake/0").color_runs);
}

TEST_F(OpenNi2SourceTest, SaysWhichCamerasThereAre) {
  fake_openni2().plug(fake_camera());
  SourceConfig config = openni2_config();
  config.openni2.device = "fake/7";
  EXPECT_THAT(refusal(config), HasSubstr("no OpenNI2 camera 'fake/7': OpenNI2 finds fake/0"));
  config.openni2.device = "serial:X";
  EXPECT_THAT(refusal(config), HasSubstr("no OpenNI2 camera 'serial:X': OpenNI2 finds serial:F0001"));

  FakeOpenNi2Camera busy = fake_camera();
  busy.busy = true;
  fake_openni2().change(busy);
  config.openni2.device = "";
  EXPECT_THAT(refusal(config), HasSubstr("'fake/0' cannot be opened (another program may have it)"));
  config.openni2.device = "serial:F0001";
  EXPECT_THAT(refusal(config), HasSubstr("OpenNI2 finds fake/0 (which cannot be opened)"));

  fake_openni2().unplug("fake/0");
  config.openni2.device = "";
  EXPECT_THAT(refusal(config), HasSubstr("OpenNI2 finds no camera"));
}

TEST_F(OpenNi2SourceTest, ListsCamerasAndTheirFormats) {
  FakeOpenNi2Camera camera = fake_camera();
  camera.color_modes = {fake_mode(ONI_PIXEL_FORMAT_RGB888, 640, 480, 15), fake_mode(ONI_PIXEL_FORMAT_RGB888, 640, 480, 30),
                        fake_mode(ONI_PIXEL_FORMAT_YUV422, 640, 480, 30)};
  fake_openni2().plug(camera);
  camera.uri = "fake/1";
  camera.busy = true;
  fake_openni2().plug(camera);
  const Result<std::vector<ListedCamera>> listed = list_openni2_cameras();
  ASSERT_TRUE(listed) << listed.error().message;
  ASSERT_EQ(listed->size(), 2U);
  const ListedCamera& first = listed->front();
  EXPECT_EQ(first.kind, "openni2");
  EXPECT_EQ(first.id, "fake/0");
  EXPECT_EQ(first.name, "posed fake camera (serial:F0001)");
  ASSERT_EQ(first.formats.size(), 3U);
  EXPECT_EQ(first.formats[0].stream, "color");
  EXPECT_EQ(first.formats[0].format, "rgb888");
  EXPECT_EQ(first.formats[0].rate_hz, 30.0);
  EXPECT_EQ(first.formats[2].stream, "depth");
  EXPECT_EQ(first.formats[2].width, kWidth);
  EXPECT_EQ(listed->back().id, "fake/1");
  EXPECT_TRUE(listed->back().formats.empty());
  EXPECT_FALSE(fake_openni2().initialised());
}

TEST_F(OpenNi2SourceTest, ListsNothingWithoutCameras) {
  const Result<std::vector<ListedCamera>> listed = list_openni2_cameras();
  ASSERT_TRUE(listed) << listed.error().message;
  EXPECT_TRUE(listed->empty());
}

TEST_F(OpenNi2SourceTest, HoldsOpenNi2OnceForAll) {
  FakeOpenNi2Camera other = fake_camera();
  other.uri = "fake/1";
  fake_openni2().plug(fake_camera());
  fake_openni2().plug(other);
  SourceConfig config = openni2_config();
  config.openni2.device = "fake/1";
  {
    Running first(openni2_config(), kClock);
    first.open();
    {
      Running second(config, kClock);
      second.open("fake/1");
    }
    EXPECT_TRUE(fake_openni2().initialised());
    push_pair(1000, 1);
    EXPECT_EQ(first.next().kind, CaptureKind::Frame) << "it goes on while another holder lets go";
  }
  EXPECT_FALSE(fake_openni2().initialised());
}

}  // namespace
}  // namespace posed::test
