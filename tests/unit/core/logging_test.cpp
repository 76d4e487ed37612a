#include "core/logging.h"

#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace posed {
namespace {

class Logging : public testing::Test {
 protected:
  void TearDown() override { set_log_level(LogLevel::Info); }

  static std::string logged(const std::function<void()>& what) {
    testing::internal::CaptureStderr();
    what();
    return testing::internal::GetCapturedStderr();
  }
  static std::string one_of_each() {
    return logged([] {
      log_debug("d");
      log_info("i");
      log_warning("w");
      log_error("e");
    });
  }
};

TEST_F(Logging, ParsesEveryLevel) {
  EXPECT_EQ(parse_log_level("debug").value(), LogLevel::Debug);
  EXPECT_EQ(parse_log_level("info").value(), LogLevel::Info);
  EXPECT_EQ(parse_log_level("warning").value(), LogLevel::Warning);
  EXPECT_EQ(parse_log_level("error").value(), LogLevel::Error);
  EXPECT_EQ(parse_log_level("off").value(), LogLevel::Off);
}

TEST_F(Logging, RefusesOtherLevelsAndNamesTheAllowedOnes) {
  for (const char* name : {"", "Info", "warn", "verbose"}) {
    const Result<LogLevel> level = parse_log_level(name);
    ASSERT_FALSE(level) << name;
    EXPECT_EQ(level.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(level.error().message, "log level '" + std::string(name) + "': allowed are debug, info, warning, error, off");
  }
}

TEST_F(Logging, WritesWhatTheLevelLetsThrough) {
  set_log_level(LogLevel::Debug);
  EXPECT_EQ(one_of_each(), "debug: d\ninfo: i\nwarning: w\nerror: e\n");
  set_log_level(LogLevel::Info);
  EXPECT_EQ(one_of_each(), "info: i\nwarning: w\nerror: e\n");
  set_log_level(LogLevel::Warning);
  EXPECT_EQ(one_of_each(), "warning: w\nerror: e\n");
  set_log_level(LogLevel::Error);
  EXPECT_EQ(one_of_each(), "error: e\n");
  set_log_level(LogLevel::Off);
  EXPECT_EQ(one_of_each(), "");
}

TEST_F(Logging, FormatsItsArgumentsOnceOnly) {
  EXPECT_EQ(logged([] { log_info("{} of {}", 1, "{}"); }), "info: 1 of {}\n");  // braces in an argument are text
  EXPECT_EQ(logged([] { log_message(LogLevel::Info, "{broken"); }), "info: {broken\n");
}

}  // namespace
}  // namespace posed
