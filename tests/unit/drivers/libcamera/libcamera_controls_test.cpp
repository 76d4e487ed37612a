#include "drivers/libcamera/libcamera_controls.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libcamera/control_ids.h>

namespace posed {
namespace {

using ::testing::HasSubstr;
namespace controls = libcamera::controls;

libcamera::ControlInfoMap known_controls() {
  const auto whole = [](std::int32_t least, std::int32_t most) {
    return libcamera::ControlInfo(libcamera::ControlValue(least), libcamera::ControlValue(most));
  };
  return libcamera::ControlInfoMap(
      {{&controls::ExposureTime, whole(100, 20'000)},
       {&controls::AeEnable, libcamera::ControlInfo(libcamera::ControlValue(false), libcamera::ControlValue(true))},
       {&controls::AnalogueGain, libcamera::ControlInfo(libcamera::ControlValue(1.0F), libcamera::ControlValue(16.0F))},
       {&controls::Contrast, libcamera::ControlInfo(libcamera::ControlValue(-10.0F), libcamera::ControlValue(10.0F))},
       {&controls::ScalerCrop, libcamera::ControlInfo(libcamera::ControlValue(libcamera::Rectangle(0, 0, 1, 1)),
                                                      libcamera::ControlValue(libcamera::Rectangle(0, 0, 640, 480)))},
       {&controls::FrameDurationLimits,
        libcamera::ControlInfo(libcamera::ControlValue(std::int64_t{20'000}), libcamera::ControlValue(std::int64_t{200'000}))}},
      controls::controls);
}

std::string error_of(const std::string& setting) {
  const auto parsed = parse_controls(known_controls(), {setting});
  EXPECT_FALSE(parsed) << setting;
  EXPECT_TRUE(parsed || parsed.error().code == ErrorCode::Unsupported);
  return parsed ? "" : parsed.error().message;
}

TEST(LibcameraControls, AreReadByTheirTypes) {
  const auto parsed =
      parse_controls(known_controls(), {"ExposureTime=10000", "AeEnable=false", "AnalogueGain=2.5", "Contrast=-7.5"});
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->get(controls::ExposureTime), 10'000);
  EXPECT_EQ(parsed->get(controls::AeEnable), false);
  EXPECT_EQ(parsed->get(controls::AnalogueGain), 2.5F);
  EXPECT_EQ(parsed->get(controls::Contrast), -7.5F);
  EXPECT_EQ(parsed->size(), 4U);
}

TEST(LibcameraControls, LimitsAreAllowed) {
  EXPECT_TRUE(parse_controls(known_controls(), {"ExposureTime=100"}));
  EXPECT_TRUE(parse_controls(known_controls(), {"ExposureTime=20000"}));
  EXPECT_TRUE(parse_controls(known_controls(), {}));
}

TEST(LibcameraControls, SayWhatIsAllowed) {
  EXPECT_EQ(error_of("ExposureTime=99"),
            "source.libcamera.controls: ExposureTime = \"99\": allowed whole numbers from 100 to 20000");
  EXPECT_THAT(error_of("ExposureTime=20001"), HasSubstr("from 100 to 20000"));
  EXPECT_THAT(error_of("ExposureTime=1e3"), HasSubstr("whole numbers"));
  EXPECT_THAT(error_of("ExposureTime=99999999999"), HasSubstr("whole numbers"));
  EXPECT_THAT(error_of("ExposureTime="), HasSubstr("whole numbers"));
  EXPECT_THAT(error_of("AeEnable=1"), HasSubstr("allowed true or false"));
  EXPECT_THAT(error_of("AnalogueGain=17"), HasSubstr("allowed numbers from 1.0"));
  EXPECT_THAT(error_of("AnalogueGain=nan"), HasSubstr("allowed numbers from 1.0"));
  EXPECT_THAT(error_of("ScalerCrop=1"), HasSubstr("cannot be set"));
  EXPECT_THAT(error_of("exposuretime=1000"),
              HasSubstr("no control \"exposuretime\"; it has AeEnable, AnalogueGain, Contrast, ExposureTime, FrameDurationLimits"));
}

TEST(LibcameraControls, TheFramePeriodKeepsToTheCamerasLimits) {
  const auto period_of = [](TimeNs wanted_ns) {
    libcamera::ControlList list(controls::controls);
    const TimeNs agreed_ns = set_frame_period(known_controls(), wanted_ns, list);
    const auto limits = list.get(controls::FrameDurationLimits);
    EXPECT_TRUE(limits);
    EXPECT_EQ((*limits)[0] * kNsPerUs, agreed_ns);
    EXPECT_EQ((*limits)[1] * kNsPerUs, agreed_ns);
    return agreed_ns;
  };
  EXPECT_EQ(period_of(33'333'333), 33'333'000);
  EXPECT_EQ(period_of(10 * kNsPerMs), 20 * kNsPerMs);
  EXPECT_EQ(period_of(500 * kNsPerMs), 200 * kNsPerMs);

  libcamera::ControlList untouched(controls::controls);
  const libcamera::ControlInfoMap none({}, controls::controls);
  EXPECT_EQ(set_frame_period(none, 33'333'333, untouched), 33'333'333);
  EXPECT_TRUE(untouched.empty());
}

}  // namespace
}  // namespace posed
