#include "tools/posectl/device_report.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "config/config_loader.h"

namespace posed {
namespace {

using testing::HasSubstr;
using testing::Not;

const ListedCamera kCarmine{"openni2",
                            "1d27/0609@1/7",
                            "PrimeSense \"Carmine\"\n1.09",
                            {{"color", "rgb888", 640, 480, 30}, {"color", "rgb888", 320, 240, 60}, {"depth", "mm", 640, 480, 25}}};
const ListedCamera kWebcam{"v4l2", "/dev/video0", "Webcam (usb-1)", {{"color", "yuyv", 640, 480, 30}}};
const ListedCamera kStereoColor{"v4l2", "/dev/video4", "Stereo (usb-2)", {{"color", "yuyv", 640, 480, 60}}};
const ListedCamera kStereoDepth{"v4l2", "/dev/video2", "Stereo (usb-2)", {{"depth", "z16", 640, 480, 15}}};
const ListedCamera kSensor{"libcamera", "/base/soc/i2c0mux/i2c@1/imx219@10", "imx219", {{"color", "NV12", 1640, 1232, 0}}};

std::vector<DriverListing> found(std::vector<ListedCamera> openni2, std::vector<ListedCamera> v4l2,
                                 std::vector<ListedCamera> libcamera) {
  return {{"openni2", true, std::move(openni2), {}},
          {"v4l2", true, std::move(v4l2), {}},
          {"libcamera", true, std::move(libcamera), {}}};
}

Config suggested(const std::vector<DriverListing>& cameras) {
  const Result<std::string> text = suggest_config(cameras);
  EXPECT_TRUE(text) << text.error().message;
  const Result<Config> config = parse_config(*text, "suggested.toml");
  EXPECT_TRUE(config) << config.error().message << *text;
  return config.value_or(Config{});
}

TEST(DeviceReport, ListsFormatsWithTheKeysThatNameTheCamera) {
  const std::string text = format_devices({found({kCarmine}, {}, {kSensor}), true, {"gpiochip0 pinctrl, 54 lines"}});
  EXPECT_THAT(text, HasSubstr("  PrimeSense \"Carmine\"?1.09\n    source.openni2.device = \"1d27/0609@1/7\"\n"));
  EXPECT_THAT(text, HasSubstr("    color    rgb888   640x480 30 Hz, 320x240 60 Hz\n    depth    mm       640x480 25 Hz\n"));
  EXPECT_THAT(text, HasSubstr("  v4l2: none\n"));
  EXPECT_THAT(text, HasSubstr("source.libcamera.camera = \"/base/soc/i2c0mux/i2c@1/imx219@10\""));
  EXPECT_THAT(text, HasSubstr("1640x1232\n"));
  EXPECT_THAT(text, HasSubstr("GPIO chips and lines\n  gpiochip0 pinctrl, 54 lines\n"));
}

TEST(DeviceReport, SaysWhatIsNotBuiltAndWhatFailed) {
  std::vector<DriverListing> cameras = found({}, {}, {});
  cameras[0].built = false;
  cameras[1].status = make_error(ErrorCode::Io, "/dev: permission denied");
  const std::string text = format_devices({cameras, false, {}});
  EXPECT_THAT(text, HasSubstr("openni2: not in this build"));
  EXPECT_THAT(text, HasSubstr("v4l2: could not look: /dev: permission denied"));
  EXPECT_THAT(text, HasSubstr("GPIO chips and lines\n  not in this build"));
}

TEST(DeviceReport, JsonHoldsTheSame) {
  std::vector<DriverListing> cameras = found({kCarmine}, {}, {});
  cameras[0].cameras[0].name = "no UTF-8: \xff";
  cameras[1].status = make_error(ErrorCode::Io, "broken");
  const nlohmann::json root = nlohmann::json::parse(devices_json({cameras, true, {"gpiochip0"}}));
  EXPECT_EQ(root.at("drivers").at(0).at("cameras").at(0).at("id"), "1d27/0609@1/7");
  EXPECT_EQ(root.at("drivers").at(0).at("cameras").at(0).at("formats").at(2).at("rate_hz"), 25.0);
  EXPECT_EQ(root.at("drivers").at(1).at("error"), "broken");
  EXPECT_EQ(root.at("gpio").at(0), "gpiochip0");
}

TEST(SuggestConfig, PrefersOpenNi2) {
  const Config config = suggested(found({kCarmine}, {kStereoDepth, kStereoColor}, {}));
  EXPECT_EQ(config.source.kind, SourceKind::OpenNi2);
  EXPECT_EQ(config.source.openni2.device, "1d27/0609@1/7");
  EXPECT_EQ(config.source.live.rate_hz, 25.0) << "the depth stream has no more";
  EXPECT_EQ(config.intrinsics.width, 640);
}

TEST(SuggestConfig, PairsTheNodesOfOneDevice) {
  const Config config = suggested(found({}, {kWebcam, kStereoDepth, kStereoColor}, {}));
  EXPECT_EQ(config.source.kind, SourceKind::V4l2);
  EXPECT_EQ(config.source.v4l2.device, "/dev/video4");
  EXPECT_EQ(config.source.depth.node.device, "/dev/video2");
  EXPECT_EQ(config.source.live.rate_hz, 15.0);
  EXPECT_EQ(config.intrinsics.depth_units_per_metre, 1000.0);
}

TEST(SuggestConfig, TakesAnotherColorCameraWhereTheDeviceHasNone) {
  EXPECT_EQ(suggested(found({}, {kWebcam, kStereoDepth}, {kSensor})).source.v4l2.device, "/dev/video0");
  const std::vector<DriverListing> cameras = found({}, {kStereoDepth}, {kSensor});
  const Config config = suggested(cameras);
  EXPECT_EQ(config.source.kind, SourceKind::Libcamera);
  EXPECT_EQ(config.source.libcamera.camera, kSensor.id);
  EXPECT_THAT(*suggest_config(cameras), HasSubstr("imx219 was not found to deliver 640x480 color"));
  EXPECT_THAT(*suggest_config(found({}, {kWebcam, kStereoDepth}, {})), Not(HasSubstr("was not found to deliver")));
}

TEST(SuggestConfig, NeedsDepth) {
  const Result<std::string> config = suggest_config(found({}, {kWebcam}, {kSensor}));
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace posed
