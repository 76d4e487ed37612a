#include "drivers/gpio/gpio_worker.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.h"
#include "tests/unit/drivers/gpio/fake_lines.h"

namespace posed {
namespace {

constexpr int kLight = 3;
constexpr int kEnable = 5;
constexpr int kTrigger = 7;
constexpr TimeNs kStart_ns = 1'000 * kNsPerSecond;

class GpioWorkerTest : public ::testing::Test {
 protected:
  GpioWorker& worker() {
    if (!worker_) {
      worker_.emplace(config_, chip_.access(), clock_, [this](const Error& error) { errors_.push_back(error.message); });
    }
    return *worker_;
  }

  /// As the thread would that was just woken: steps at once and whenever it is due.
  void run_for(TimeNs duration_ns) {
    next_ns_ = worker().step();
    sleep_for(duration_ns);
  }

  /// The same of a thread that nothing has woken.
  void sleep_for(TimeNs duration_ns) {
    const TimeNs end_ns = clock_.now_ns() + duration_ns;
    while (next_ns_ <= end_ns) {
      ASSERT_GT(next_ns_, clock_.now_ns());
      clock_.advance(next_ns_ - clock_.now_ns());
      next_ns_ = worker().step();
    }
    clock_.advance(end_ns - clock_.now_ns());
  }

  /// Milliseconds after the start.
  static FakeChip::Edge edge(TimeNs at_ms, bool active) { return {kStart_ns + at_ms * kNsPerMs, active}; }

  GpioConfig config_{.chip = "fake"};
  ManualClock clock_{kStart_ns};
  FakeChip chip_{clock_};
  std::vector<std::string> errors_;

 private:
  std::optional<GpioWorker> worker_;
  TimeNs next_ns_ = kNever_ns;
};

using Edges = std::vector<FakeChip::Edge>;

TEST_F(GpioWorkerTest, TheLightBlinksAtExactTimesByItsState) {
  config_.status_line = kLight;
  config_.waiting_ms = {300, 700};
  config_.lost_ms = {100, 100};
  run_for(1'500 * kNsPerMs);
  EXPECT_EQ(chip_.edges(kLight), (Edges{edge(0, true), edge(300, false), edge(1000, true), edge(1300, false)}));

  EXPECT_TRUE(worker().show(LightState::Lost));
  EXPECT_FALSE(worker().show(LightState::Lost));
  run_for(250 * kNsPerMs);  // a new state begins its own pattern
  EXPECT_TRUE(worker().show(LightState::Tracking));
  run_for(5'000 * kNsPerMs);
  EXPECT_TRUE(worker().show(LightState::Paused));
  run_for(60 * kNsPerMs);
  EXPECT_EQ(chip_.edges(kLight), (Edges{edge(0, true), edge(300, false), edge(1000, true), edge(1300, false), edge(1500, true),
                                        edge(1600, false), edge(1700, true), edge(6800, false)}));
}

TEST_F(GpioWorkerTest, TheLightGoesOutAtTheEnd) {
  config_.status_line = kLight;
  config_.trigger_line = kTrigger;
  config_.waiting_ms = {1000};
  worker().step();
  EXPECT_TRUE(chip_.level(kLight));
  EXPECT_TRUE(chip_.level(kTrigger));
  worker().finish();
  EXPECT_FALSE(chip_.level(kLight));
  EXPECT_FALSE(chip_.level(kTrigger));
}

TEST_F(GpioWorkerTest, WithoutLinesNothingIsDone) {
  EXPECT_EQ(worker().step(), kNever_ns);
  EXPECT_TRUE(worker().enabled());
  EXPECT_EQ(worker().health(), GpioHealth{});
  EXPECT_FALSE(worker().show(LightState::Lost));
}

TEST_F(GpioWorkerTest, AMissingChipIsToldOnceAskedForEverySecondAndTakenWhenItComes) {
  config_.status_line = kLight;
  config_.tracking_ms = {1000};
  chip_.set_present(false);
  worker().show(LightState::Tracking);
  run_for(3'500 * kNsPerMs);
  EXPECT_EQ(errors_, std::vector<std::string>{"the chip is away"});
  EXPECT_FALSE(worker().health().ok);
  EXPECT_EQ(chip_.requests(),
            (std::vector<TimeNs>{kStart_ns, kStart_ns + kNsPerSecond, kStart_ns + 2 * kNsPerSecond, kStart_ns + 3 * kNsPerSecond}));
  chip_.set_present(true);
  run_for(kNsPerSecond);
  EXPECT_TRUE(worker().health().ok);
  EXPECT_TRUE(chip_.level(kLight));
  EXPECT_EQ(errors_.size(), 1U);
}

TEST_F(GpioWorkerTest, AChipThatVanishesIsNoticedAlthoughNothingChanges) {
  config_.status_line = kLight;
  config_.enable_line = kEnable;
  config_.waiting_ms = {1000};  // neither a blink nor an event will show it
  run_for(kNsPerSecond / 2);
  chip_.set_present(false);
  run_for(kNsPerSecond);
  EXPECT_FALSE(worker().health().ok);
  EXPECT_EQ(chip_.lines_held(), 0);
  EXPECT_EQ(errors_.size(), 2U);  // one for each line
  chip_.set_present(true);
  run_for(kNsPerSecond);
  EXPECT_TRUE(worker().health().ok);
  chip_.set_present(false);
  run_for(kNsPerSecond);
  EXPECT_EQ(errors_.size(), 4U);  // told again, since the lines were there in between
}

TEST_F(GpioWorkerTest, OneLineThatIsTakenLeavesTheOthersAtWork) {
  config_.status_line = kLight;
  config_.enable_line = kEnable;
  config_.trigger_line = kTrigger;
  chip_.set_taken(kLight, true);
  chip_.set_input(kEnable, true);
  run_for(kNsPerSecond);
  EXPECT_EQ(errors_, std::vector<std::string>{"line 3 is taken"});
  EXPECT_TRUE(worker().enabled());
  EXPECT_GE(worker().health().trigger_pulses, 30U);
  EXPECT_FALSE(worker().health().ok);
  chip_.set_taken(kLight, false);
  run_for(kNsPerSecond);
  EXPECT_TRUE(worker().health().ok);
}

TEST_F(GpioWorkerTest, TheEnableInputCountsOnceItHasSettled) {
  config_.enable_line = kEnable;
  chip_.set_input(kEnable, true);
  EXPECT_FALSE(worker().enabled());
  worker().step();
  EXPECT_TRUE(worker().enabled()) << "the first level counts at once";
  run_for(100 * kNsPerMs);

  chip_.set_input(kEnable, false);
  EXPECT_GE(worker().event_fd(), 0);
  worker().step();
  EXPECT_EQ(worker().event_fd(), -1) << "a line that chatters must not keep the thread awake";
  run_for(EnableInput::kSettle_ns - 1);
  EXPECT_TRUE(worker().enabled());
  run_for(1);
  EXPECT_FALSE(worker().enabled());
  chip_.set_input(kEnable, true);
  run_for(EnableInput::kSettle_ns);
  EXPECT_TRUE(worker().enabled());
}

TEST_F(GpioWorkerTest, ABouncingEnableInputIsWaitedFor) {
  config_.enable_line = kEnable;
  chip_.set_input(kEnable, true);
  run_for(100 * kNsPerMs);
  for (int bounce = 0; bounce < 20; ++bounce) {  // ends where it began, and never keeps still for long
    chip_.set_input(kEnable, bounce % 2 == 1);
    run_for(7 * kNsPerMs);
    EXPECT_TRUE(worker().enabled()) << bounce;
  }
  run_for(kNsPerSecond);
  EXPECT_TRUE(worker().enabled());
}

TEST_F(GpioWorkerTest, AnEnableInputWhoseEventIsLostIsReadAgain) {
  config_.enable_line = kEnable;
  chip_.set_input(kEnable, true);
  run_for(100 * kNsPerMs);
  chip_.set_input_silently(kEnable, false);
  sleep_for(HeldLine::kRecheck_ns + EnableInput::kSettle_ns);
  EXPECT_FALSE(worker().enabled());
}

TEST_F(GpioWorkerTest, AnEnableInputThatCannotTellIsPolled) {
  config_.enable_line = kEnable;
  chip_.set_tells_events(false);
  chip_.set_input(kEnable, true);
  run_for(100 * kNsPerMs);
  EXPECT_EQ(worker().event_fd(), -1);
  chip_.set_input(kEnable, false);
  sleep_for(EnableInput::kPoll_ns + EnableInput::kSettle_ns);
  EXPECT_FALSE(worker().enabled());
}

TEST_F(GpioWorkerTest, TheLastLevelHoldsWhileTheEnableInputIsAway) {
  config_.enable_line = kEnable;
  chip_.set_present(false);
  run_for(2 * kNsPerSecond);
  EXPECT_FALSE(worker().enabled()) << "nothing has said that it may run";
  for (const bool level : {true, false}) {
    chip_.set_present(true);
    chip_.set_input(kEnable, level);
    run_for(2 * kNsPerSecond);
    EXPECT_EQ(worker().enabled(), level);
    chip_.set_present(false);
    chip_.set_input(kEnable, !level);
    run_for(5 * kNsPerSecond);
    EXPECT_EQ(worker().enabled(), level);
    EXPECT_FALSE(worker().health().ok);
  }
}

TEST_F(GpioWorkerTest, TenThousandPulsesDoNotDriftHoweverLateEachIs) {
  config_.trigger_line = kTrigger;
  config_.trigger_rate_hz = 29.97;
  constexpr std::uint64_t kPulses = 10'000;
  TimeNs worst_ns = 0;
  std::uint32_t noise = 1;
  while (worker().health().trigger_pulses < kPulses) {
    const TimeNs next_ns = worker().step();
    noise = noise * 1'664'525 + 1'013'904'223;
    clock_.advance(next_ns - clock_.now_ns() + noise % 400'000);  // the thread wakes up to 0.4 ms late
  }
  std::vector<TimeNs> begins_ns;
  for (const FakeChip::Edge& change : chip_.edges(kTrigger)) {
    if (change.active) {
      begins_ns.push_back(change.at_ns);
    }
  }
  ASSERT_EQ(begins_ns.size(), kPulses);
  for (std::uint64_t i = 0; i < kPulses; ++i) {
    const TimeNs lateness_ns = begins_ns[i] - kStart_ns - std::llround(static_cast<double>(i) * 1e9 / 29.97);
    ASSERT_GE(lateness_ns, 0) << i;
    ASSERT_LT(lateness_ns, 400'000) << i;
    worst_ns = std::max(worst_ns, lateness_ns);
  }
  const GpioHealth health = worker().health();
  EXPECT_EQ(health.trigger_missed, 0U);
  EXPECT_EQ(health.last_trigger_ns, begins_ns.back());
  EXPECT_EQ(health.worst_trigger_lateness_ns, worst_ns);
  EXPECT_GT(worst_ns, 390'000);
}

TEST_F(GpioWorkerTest, PulsesLastAMillisecond) {
  config_.trigger_line = kTrigger;
  config_.trigger_rate_hz = 100;
  run_for(25 * kNsPerMs);
  EXPECT_EQ(chip_.edges(kTrigger),
            (Edges{edge(0, true), edge(1, false), edge(10, true), edge(11, false), edge(20, true), edge(21, false)}));
}

TEST_F(GpioWorkerTest, PulsesThatTheThreadSleptThroughAreMissedAndTheNextOnesAreOnTime) {
  config_.trigger_line = kTrigger;
  config_.trigger_rate_hz = 100;
  run_for(5 * kNsPerMs);  // pulse 0
  clock_.advance(50 * kNsPerMs);
  run_for(10 * kNsPerMs);  // at 55 ms, the one of 50 ms; then that of 60 ms
  const GpioHealth health = worker().health();
  EXPECT_EQ(chip_.edges(kTrigger),
            (Edges{edge(0, true), edge(1, false), edge(55, true), edge(56, false), edge(60, true), edge(61, false)}));
  EXPECT_EQ(health.trigger_pulses, 3U);
  EXPECT_EQ(health.trigger_missed, 4U);
  EXPECT_EQ(health.worst_trigger_lateness_ns, 5 * kNsPerMs);
}

TEST_F(GpioWorkerTest, APulseThatEndsTooLateKeepsItsDistanceFromTheNext) {
  config_.trigger_line = kTrigger;
  config_.trigger_rate_hz = 100;
  worker().step();                // pulse 0 begins
  clock_.advance(10 * kNsPerMs);  // and ends when pulse 1 is due
  run_for(5 * kNsPerMs);
  EXPECT_EQ(chip_.edges(kTrigger), (Edges{edge(0, true), edge(10, false), edge(11, true), edge(12, false)}));
}

TEST_F(GpioWorkerTest, ATriggerThatComesBackBeginsAnew) {
  config_.trigger_line = kTrigger;
  config_.trigger_rate_hz = 10;
  run_for(250 * kNsPerMs);
  chip_.set_present(false);
  run_for(100 * kNsPerMs);  // the pulse of 300 ms fails
  EXPECT_FALSE(worker().health().ok);
  chip_.set_present(true);
  run_for(1'000 * kNsPerMs);
  const Edges edges = chip_.edges(kTrigger);
  EXPECT_EQ(edges[6], edge(1300, true));
  const GpioHealth health = worker().health();
  EXPECT_TRUE(health.ok);
  EXPECT_EQ(health.trigger_missed, 0U) << "while the line was away none was due";
  EXPECT_EQ(health.trigger_pulses, 4U);
}

TEST_F(GpioWorkerTest, LinesAreWrittenOnlyWhereTheyChangeOrAreRechecked) {
  config_.status_line = kLight;
  config_.waiting_ms = {1000};
  run_for(10 * kNsPerSecond - 1);
  EXPECT_EQ(chip_.writes(), 11);  // at the request, and once a second
}

}  // namespace
}  // namespace posed
