#include "drivers/v4l2/v4l2_listing.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/v4l2/v4l2_source.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/drivers/v4l2_rig.h"

namespace posed::test {
namespace {

using testing::HasSubstr;

class V4l2Listing : public testing::Test {
 protected:
  V4l2Listing() : kernel_(clock_) {}

  std::string node(const std::string& name) {
    const std::string path = (folder_.path() / name).string();
    std::ofstream{path};
    return path;
  }

  TemporaryFolder folder_;
  ScriptedClock clock_;
  FakeKernel kernel_;
};

TEST_F(V4l2Listing, CamerasWithFormatsSizesAndRates) {
  FakeCamera color;
  color.card = "Colour";
  color.rate_hz = 25;
  color.formats = {{V4L2_PIX_FMT_YUYV, {{640, 480}, {320, 240}}}, {V4L2_PIX_FMT_BGR32, {{640, 480}}}};
  FakeCamera depth;
  depth.card = "Depth";
  depth.formats = {{V4L2_PIX_FMT_Z16, {{848, 480}}}};
  FakeCamera metadata;
  metadata.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  kernel_.plug(node("video0"), color);
  kernel_.plug(node("video1"), metadata);
  kernel_.plug(node("video10"), depth);
  kernel_.plug(node("video2"), color);
  kernel_.refuse((folder_.path() / "video2").string(), 0, EACCES);
  node("video0x");
  node("media0");

  const auto cameras = list_v4l2_cameras(kernel_, folder_.path());
  ASSERT_TRUE(cameras);
  ASSERT_EQ(cameras->size(), 3U);
  const ListedCamera& first = (*cameras)[0];
  EXPECT_EQ(first.kind, "v4l2");
  EXPECT_EQ(first.id, (folder_.path() / "video0").string());
  EXPECT_EQ(first.name, "Colour (usb-fake)");
  ASSERT_EQ(first.formats.size(), 3U);
  EXPECT_EQ(first.formats[0].stream, "color");
  EXPECT_EQ(first.formats[0].format, "yuyv");
  EXPECT_EQ(first.formats[0].width, 640);
  EXPECT_EQ(first.formats[1].height, 240);
  EXPECT_EQ(first.formats[1].rate_hz, 25.0);
  EXPECT_EQ(first.formats[2].format, "BGR4");
  EXPECT_THAT((*cameras)[1].name, HasSubstr("Permission denied"));
  const ListedCamera& last = (*cameras)[2];
  EXPECT_THAT(last.id, HasSubstr("video10"));
  ASSERT_EQ(last.formats.size(), 1U);
  EXPECT_EQ(last.formats[0].stream, "depth");
  EXPECT_EQ(last.formats[0].format, "z16");
  EXPECT_EQ(kernel_.open_descriptors(), 0U);
}

TEST_F(V4l2Listing, NoneIsNoError) {
  const auto cameras = list_v4l2_cameras(kernel_, folder_.path());
  ASSERT_TRUE(cameras);
  EXPECT_TRUE(cameras->empty());
}

TEST_F(V4l2Listing, AFolderThatThereIsNot) {
  const auto cameras = list_v4l2_cameras(kernel_, folder_.path() / "none");
  ASSERT_FALSE(cameras);
  EXPECT_EQ(cameras.error().code, ErrorCode::Io);
}

/// Whatever cameras this machine has, or none.
TEST(V4l2Machine, CanBeListed) {
  const auto cameras = list_v4l2_cameras();
  ASSERT_TRUE(cameras) << cameras.error().message;
  for (const ListedCamera& camera : *cameras) {
    EXPECT_THAT(camera.id, HasSubstr("/dev/video"));
  }
}

TEST(V4l2Machine, ANodeThatIsNoCameraIsRefusedByTheKernel) {
  V4l2Device device(machine_v4l2(), "/dev/null");
  ASSERT_TRUE(device.open());
  const auto capability = device.capability();
  ASSERT_FALSE(capability);
  EXPECT_THAT(capability.error().message, HasSubstr("not a V4L2 node"));
  V4l2Device away(machine_v4l2(), "/dev/there-is-no-such-node");
  const Status opened = away.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::NotFound);
}

TEST(V4l2Source, ColourAloneIsRefused) {
  SourceConfig config;
  config.kind = SourceKind::V4l2;
  config.v4l2.device = "/dev/video0";
  const ScriptedClock clock;
  const auto colour_alone = make_rgbd_source(config, {}, clock);
  ASSERT_FALSE(colour_alone);
  EXPECT_EQ(colour_alone.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(colour_alone.error().message, testing::AllOf(HasSubstr("source.depth.device"), HasSubstr("alone")));
  config.depth.node.device = "/dev/video2";
  const auto source = make_rgbd_source(config, {}, clock);
  ASSERT_TRUE(source) << "whether the cameras are there or not";
  EXPECT_THAT((*source)->info().description, testing::AllOf(HasSubstr("/dev/video0"), HasSubstr("/dev/video2")));
  config.v4l2.device.clear();
  EXPECT_FALSE(make_rgbd_source(config, {}, clock));
}

}  // namespace
}  // namespace posed::test
