#include "drivers/gpio/gpio_thread.h"

#include <atomic>
#include <filesystem>
#include <iterator>
#include <thread>

#include <gtest/gtest.h>

#include "drivers/gpio_lines.h"
#include "tests/unit/drivers/gpio/fake_lines.h"

namespace posed {
namespace {

constexpr TimeNs kLong_ns = 60 * kNsPerSecond;  // a limit for what must happen, however slow the machine

std::ptrdiff_t entries(const char* folder) {
  return std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator());
}

class GpioThreadTest : public ::testing::Test {
 protected:
  GpioThreadTest() {
    config_.chip = "fake";
    config_.status_line = 1;
    config_.enable_line = 2;
    config_.trigger_line = 3;
    config_.trigger_rate_hz = 240;
    config_.waiting_ms = {};
    config_.tracking_ms = {1000};
  }

  std::unique_ptr<GpioLines> start() {
    Result<std::unique_ptr<GpioLines>> lines =
        make_gpio_thread(config_, chip_.access(), {.name = "gpio"}, clock_, [this](const Error&) { ++errors_; });
    EXPECT_TRUE(lines) << (lines ? "" : lines.error().message);
    return lines ? std::move(*lines) : nullptr;
  }

  template <typename Condition>
  bool comes_true(Condition condition) const {
    for (const TimeNs end_ns = clock_.now_ns() + kLong_ns; clock_.now_ns() < end_ns;) {
      if (condition()) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  GpioConfig config_;
  const Clock& clock_ = SystemClock::instance();
  FakeChip chip_{clock_};
  std::atomic<int> errors_{0};
};

TEST_F(GpioThreadTest, WorksAllLinesAndLeavesThemInactive) {
  const auto lines = start();
  EXPECT_TRUE(comes_true([&] { return lines->health().ok; }));
  lines->show(LightState::Tracking);
  EXPECT_TRUE(comes_true([&] { return chip_.level(1); }));
  chip_.set_input(2, true);
  EXPECT_TRUE(comes_true([&] { return lines->enabled(); }));
  chip_.set_input(2, false);
  EXPECT_TRUE(comes_true([&] { return !lines->enabled(); }));
  EXPECT_TRUE(comes_true([&] { return lines->health().trigger_pulses >= 20; }));
  EXPECT_GE(lines->health().worst_trigger_lateness_ns, 0);
  EXPECT_EQ(chip_.edges(3).front().active, true);
  EXPECT_EQ(errors_, 0);
}

TEST_F(GpioThreadTest, AnEdgeOfTheInputWakesTheThread) {
  config_.status_line = config_.trigger_line = -1;  // which wake it, too
  const auto lines = start();
  const TimeNs begin_ns = clock_.now_ns();
  constexpr int kChanges = 20;
  for (int i = 0; i < kChanges; ++i) {
    const bool level = i % 2 == 0;
    chip_.set_input(2, level);
    ASSERT_TRUE(comes_true([&] { return lines->enabled() == level; }));
  }
  // A thread that only looks at the line every second would take twice as long; one that is woken takes 0.4 s.
  EXPECT_LT(clock_.now_ns() - begin_ns, kChanges * kNsPerSecond / 2);
}

TEST_F(GpioThreadTest, EndsAtOnceAndLeaksNothing) {
  start().reset();  // whatever the libraries open once
  const std::ptrdiff_t descriptors = entries("/proc/self/fd");
  const std::ptrdiff_t threads = entries("/proc/self/task");
  config_.trigger_rate_hz = 1;
  for (int i = 0; i < 50; ++i) {
    chip_.set_present(i % 3 != 0);
    const auto lines = start();
    lines->show(LightState::Tracking);
    chip_.set_input(2, i % 2 == 0);
  }
  EXPECT_EQ(entries("/proc/self/fd"), descriptors);
  EXPECT_EQ(entries("/proc/self/task"), threads);
  EXPECT_EQ(chip_.lines_held(), 0);
  EXPECT_FALSE(chip_.level(1));
  EXPECT_FALSE(chip_.level(3));
}

TEST_F(GpioThreadTest, OutputsAreInactiveAtTheEnd) {
  config_.waiting_ms = {1000};
  {
    const auto lines = start();
    ASSERT_TRUE(comes_true([&] { return chip_.level(1); }));
  }
  EXPECT_FALSE(chip_.level(1));
  EXPECT_EQ(chip_.lines_held(), 0);
}

#ifdef POSED_HAS_GPIO
TEST(MakeGpioLines, AChipThatDoesNotExistIsToldAndTheDaemonRunsOn) {
  std::atomic<int> errors{0};
  std::string message;
  GpioConfig config;
  config.chip = "no-such-chip";
  config.status_line = 4;
  {
    const auto lines = make_gpio_lines(config, {.name = "gpio"}, SystemClock::instance(), [&](const Error& error) {
      message = error.message;
      ++errors;
    });
    ASSERT_TRUE(lines);
    while (errors == 0) {
      std::this_thread::yield();
    }
    EXPECT_FALSE((*lines)->health().ok);
  }
  EXPECT_NE(message.find("chip \"no-such-chip\" cannot be opened: No such file or directory"), std::string::npos) << message;
}
#else
TEST(MakeGpioLines, SaysWhereTheBuildHasNone) {
  GpioConfig config;
  config.chip = "gpiochip0";
  const auto lines = make_gpio_lines(config, {}, SystemClock::instance(), {});
  ASSERT_FALSE(lines);
  EXPECT_EQ(lines.error().code, ErrorCode::Unsupported);
  EXPECT_NE(lines.error().message.find("POSED_GPIO"), std::string::npos);
}
#endif

}  // namespace
}  // namespace posed
