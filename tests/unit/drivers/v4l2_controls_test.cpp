#include "drivers/v4l2/v4l2_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/v4l2_rig.h"

namespace posed::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class V4l2Controls : public testing::TestWithParam<bool>, public V4l2Rig {
 protected:
  V4l2Controls() : device_(kernel_, kColorPath) {
    color_->extended_controls = GetParam();
    color_->controls = {
        {V4L2_CID_BRIGHTNESS, V4L2_CTRL_TYPE_INTEGER, "Brightness", -64, 64, 1, 0, {}, 0},
        {V4L2_CID_AUTO_WHITE_BALANCE, V4L2_CTRL_TYPE_BOOLEAN, "White Balance, Automatic", 0, 1, 1, 0, {}, 1},
        {V4L2_CID_POWER_LINE_FREQUENCY, V4L2_CTRL_TYPE_MENU, "Power Line Frequency", 0, 2, 1, 0, {"Disabled", "50 Hz", "60 Hz"}, 0},
        {V4L2_CID_EXPOSURE_AUTO,
         V4L2_CTRL_TYPE_MENU,
         "Auto Exposure",
         0,
         3,
         1,
         0,
         {"", "Manual Mode", "", "Aperture Priority Mode"},
         3},
        {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Exposure Time, Absolute", 5, 2000, 5, 0, {}, 250},
        {V4L2_CID_LINK_FREQ, V4L2_CTRL_TYPE_INTEGER_MENU, "Link Frequency", 0, 1, 1, 0, {"450000000", "900000000"}, 0},
        {V4L2_CID_ANALOGUE_GAIN, V4L2_CTRL_TYPE_INTEGER, "Analogue Gain", 0, 10, 1, V4L2_CTRL_FLAG_READ_ONLY, {}, 1},
        {V4L2_CID_PIXEL_RATE, V4L2_CTRL_TYPE_INTEGER64, "Pixel Rate", 0, 1'000'000'000, 1, 0, {}, 1},
        {V4L2_CID_DETECT_MD_MODE, V4L2_CTRL_TYPE_BITMASK, "Modes", 0, 0x15, 0, 0, {}, 0}};
    EXPECT_TRUE(device_.open());
  }

  std::int64_t value_of(std::uint32_t id) const {
    for (const FakeControl& control : color_->controls) {
      if (control.id == id) {
        return control.value;
      }
    }
    return -1;
  }

  std::string refusal(const std::string& setting) {
    const Status set = set_controls(device_, {setting});
    EXPECT_FALSE(set) << setting;
    return set ? std::string() : set.error().message;
  }

  V4l2Device device_;
};

TEST_P(V4l2Controls, AreSetByTheirNames) {
  const Status set = set_controls(
      device_, {"brightness=-12", "white_balance_automatic=false", "power_line_frequency=2", "auto_exposure=manual_mode",
                "exposure_time_absolute=0x64", "link_frequency=1", "pixel_rate=900000000", "modes=0x11"});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(value_of(V4L2_CID_BRIGHTNESS), -12);
  EXPECT_EQ(value_of(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  EXPECT_EQ(value_of(V4L2_CID_POWER_LINE_FREQUENCY), 2);
  EXPECT_EQ(value_of(V4L2_CID_EXPOSURE_AUTO), 1);
  EXPECT_EQ(value_of(V4L2_CID_EXPOSURE_ABSOLUTE), 100);
  EXPECT_EQ(value_of(V4L2_CID_LINK_FREQ), 1);
  EXPECT_EQ(value_of(V4L2_CID_PIXEL_RATE), 900'000'000);
  EXPECT_EQ(value_of(V4L2_CID_DETECT_MD_MODE), 0x11);
}

TEST_P(V4l2Controls, ErrorsNameDeviceControlValueAndWhatIsAllowed) {
  EXPECT_THAT(refusal("brightness=65"), AllOf(HasSubstr(kColorPath), HasSubstr("brightness = 65"), HasSubstr("-64 to 64")));
  EXPECT_THAT(refusal("brightness=-65"), HasSubstr("-64 to 64"));
  EXPECT_THAT(refusal("brightness=bright"), HasSubstr("-64 to 64"));
  EXPECT_THAT(refusal("brightness="), HasSubstr("-64 to 64"));
  EXPECT_THAT(refusal("brightness=0x"), HasSubstr("-64 to 64"));
  EXPECT_THAT(refusal("exposure_time_absolute=101"), HasSubstr("5 to 2000 in steps of 5"));
  EXPECT_THAT(refusal("white_balance_automatic=2"), HasSubstr("0 (false) and 1 (true)"));
  EXPECT_THAT(refusal("auto_exposure=2"), HasSubstr("1 (manual_mode), 3 (aperture_priority_mode)"));
  EXPECT_THAT(refusal("auto_exposure=auto"), HasSubstr("1 (manual_mode), 3 (aperture_priority_mode)"));
  EXPECT_THAT(refusal("modes=0x2"), HasSubstr("the bits of 0x15"));
  EXPECT_THAT(refusal("analogue_gain=2"), HasSubstr("can only be read"));
  EXPECT_THAT(refusal("exposure=2"), AllOf(HasSubstr("no control exposure"), HasSubstr("exposure_time_absolute")));
}

TEST_P(V4l2Controls, TheDriversRefusalIsTold) {
  kernel_.refuse(kColorPath, VIDIOC_S_CTRL, EBUSY);
  EXPECT_THAT(refusal("brightness=3"), AllOf(HasSubstr("brightness = 3"), HasSubstr("another program")));
}

TEST_P(V4l2Controls, AreSetAtEachOpening) {
  device_.close();
  config_.v4l2.controls = {"brightness=33"};
  const std::unique_ptr<V4l2Camera> opened = camera();
  ASSERT_TRUE(opened->open());
  EXPECT_EQ(value_of(V4L2_CID_BRIGHTNESS), 33);
  opened->close();
  color_->controls[0].value = 0;
  ASSERT_TRUE(opened->open());
  EXPECT_EQ(value_of(V4L2_CID_BRIGHTNESS), 33);
  config_.v4l2.controls = {"brightness=99"};
  EXPECT_FALSE(camera()->open());
}

INSTANTIATE_TEST_SUITE_P(ExtendedAndOldInterface, V4l2Controls, testing::Bool());

TEST(V4l2ControlWord, SpellsAsV4l2CtlDoes) {
  EXPECT_EQ(control_word("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(control_word("White Balance, Auto & Preset"), "white_balance_auto_preset");
  EXPECT_EQ(control_word("Gain (dB)"), "gain_db");
  EXPECT_EQ(control_word(" 50 Hz"), "50_hz");
}

}  // namespace
}  // namespace posed::test
