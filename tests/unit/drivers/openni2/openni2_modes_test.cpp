#include "drivers/openni2/openni2_modes.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

openni::VideoMode mode(openni::PixelFormat format, int fps, int width = 640, int height = 480) {
  openni::VideoMode made;
  made.setPixelFormat(format);
  made.setFps(fps);
  made.setResolution(width, height);
  return made;
}

std::vector<std::string> names(const std::vector<openni::VideoMode>& modes) {
  std::vector<std::string> made;
  for (const openni::VideoMode& each : modes) {
    made.push_back(openni2_mode_name(each));
  }
  return made;
}

TEST(OpenNi2Modes, ColourBeforeGreyThenTheNearestRateThenTheFormat) {
  const std::vector<openni::VideoMode> modes = {
      mode(openni::PIXEL_FORMAT_GRAY8, 30),  mode(openni::PIXEL_FORMAT_RGB888, 60),          mode(openni::PIXEL_FORMAT_YUV422, 30),
      mode(openni::PIXEL_FORMAT_YUYV, 30),   mode(openni::PIXEL_FORMAT_RGB888, 25),          mode(openni::PIXEL_FORMAT_JPEG, 30),
      mode(openni::PIXEL_FORMAT_GRAY16, 30), mode(openni::PIXEL_FORMAT_RGB888, 30, 320, 240)};
  const openni::Array<openni::VideoMode> offered(modes.data(), static_cast<int>(modes.size()));
  EXPECT_EQ(names(usable_color_modes(offered, {640, 480, 30.0})),
            (std::vector<std::string>{"640x480 yuyv at 30 Hz", "640x480 yuv422 at 30 Hz", "640x480 rgb888 at 25 Hz",
                                      "640x480 rgb888 at 60 Hz", "640x480 gray8 at 30 Hz"}));
  EXPECT_EQ(names(usable_color_modes(offered, {320, 240, 30.0})), (std::vector<std::string>{"320x240 rgb888 at 30 Hz"}));
  EXPECT_TRUE(usable_depth_modes(offered, {640, 480, 30.0}).empty());
}

TEST(OpenNi2Modes, DepthOfTheNearestRateThenOfTheLargerRange) {
  const std::vector<openni::VideoMode> modes = {
      mode(openni::PIXEL_FORMAT_SHIFT_9_2, 30), mode(openni::PIXEL_FORMAT_DEPTH_100_UM, 30),
      mode(openni::PIXEL_FORMAT_DEPTH_1_MM, 60), mode(openni::PIXEL_FORMAT_DEPTH_1_MM, 30)};
  const openni::Array<openni::VideoMode> offered(modes.data(), static_cast<int>(modes.size()));
  EXPECT_EQ(
      names(usable_depth_modes(offered, {640, 480, 30.0})),
      (std::vector<std::string>{"640x480 depth_1_mm at 30 Hz", "640x480 depth_100_um at 30 Hz", "640x480 depth_1_mm at 60 Hz"}));
}

}  // namespace
}  // namespace posed
