#include "daemon/supervisor.h"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "daemon/exit_code.h"
#include "tests/unit/daemon/fake_gpio_lines.h"

namespace posed {
namespace {

/// An App that does what a test says when it is started.
class FakeApp final : public App {
 public:
  std::function<void()> on_start = [] {};
  HealthReport report;
  bool finished = false;
  Status start_status;
  bool can_save = true;
  int save_requests = 0;
  int stops = 0;
  bool paused = false;

  const SourceInfo& source_info() const override { return info_; }
  Status start() override {
    on_start();
    return start_status;
  }
  bool wait_finished(TimeNs) override { return finished; }
  void stop() override { ++stops; }
  HealthReport health() const override {
    HealthReport now = report;
    now.paused = paused;
    return now;
  }
  void set_paused(bool value) override { paused = value; }
  Status request_map_save() override {
    ++save_requests;
    return can_save ? Status{} : make_error(ErrorCode::InvalidConfig, "map.file is empty");
  }
  std::optional<Se3> keyframe_pose(std::uint64_t) const override { return std::nullopt; }

 private:
  SourceInfo info_{.description = "fake app"};
};

class SupervisorTest : public ::testing::Test {
 protected:
  SupervisorTest() {
    options_.poll_period_ns = kNsPerMs;
    EXPECT_TRUE(Supervisor::block_signals());
  }

  SupervisorOptions options_;
  FakeApp app_;
};

TEST_F(SupervisorTest, SignalsStopThePipeline) {
  for (const int signal : {SIGTERM, SIGINT}) {
    FakeApp app;
    app.on_start = [&] { kill(getpid(), signal); };
    Supervisor supervisor(options_);
    const Result<RunEnd> end = supervisor.run(app);
    ASSERT_TRUE(end) << end.error().message;
    EXPECT_EQ(*end, RunEnd::Signal);
    EXPECT_EQ(app.stops, 1);
  }
}

TEST_F(SupervisorTest, SigUsr1HasTheMapSavedAndEndsNothing) {
  options_.exit_at_end = true;
  for (const bool possible : {true, false}) {
    FakeApp app;
    app.finished = true;  // ends the run at the first poll, which comes after the signal
    app.can_save = possible;
    app.on_start = [] { kill(getpid(), SIGUSR1); };
    Supervisor supervisor(options_);
    const Result<RunEnd> end = supervisor.run(app);
    ASSERT_TRUE(end) << end.error().message;
    EXPECT_EQ(*end, RunEnd::SourceEnded);
    EXPECT_EQ(app.save_requests, 1);
  }
}

TEST_F(SupervisorTest, EndsWithTheSourceWhereAsked) {
  options_.exit_at_end = true;
  app_.finished = true;
  {
    Supervisor supervisor(options_);
    EXPECT_EQ(supervisor.run(app_).value(), RunEnd::SourceEnded);
  }
  app_.report.source_failed = true;
  Supervisor supervisor(options_);
  EXPECT_EQ(supervisor.run(app_).value(), RunEnd::SourceFailed);
}

TEST_F(SupervisorTest, OutlivesTheSourceOtherwise) {
  app_.finished = true;
  app_.report.source_ended = true;
  // The signal comes from a poll after the one that saw the end, so the end alone did not stop the run.
  struct LateSignal final : public App {
    FakeApp& app;
    mutable int polls = 0;
    explicit LateSignal(FakeApp& wrapped) : app(wrapped) {}
    const SourceInfo& source_info() const override { return app.source_info(); }
    Status start() override { return app.start(); }
    bool wait_finished(TimeNs timeout_ns) override { return app.wait_finished(timeout_ns); }
    void stop() override { app.stop(); }
    HealthReport health() const override {
      if (++polls == 5) {
        kill(getpid(), SIGTERM);
      }
      return app.health();
    }
    void set_paused(bool paused) override { app.set_paused(paused); }
    Status request_map_save() override { return app.request_map_save(); }
    std::optional<Se3> keyframe_pose(std::uint64_t) const override { return std::nullopt; }
  } late(app_);
  Supervisor supervisor(options_);
  EXPECT_EQ(supervisor.run(late).value(), RunEnd::Signal);
  EXPECT_GE(late.polls, 5);
}

TEST_F(SupervisorTest, APipelineThatCannotStartIsTheError) {
  app_.start_status = make_error(ErrorCode::Unavailable, "no threads left");
  Supervisor supervisor(options_);
  const Result<RunEnd> end = supervisor.run(app_);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "no threads left");
}

TEST_F(SupervisorTest, TellsSystemdWhenItIsReadyAndWhenItStops) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / ("posed_notify_" + std::to_string(getpid()));
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  ASSERT_GE(fd, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path.string().size(), sizeof(address.sun_path));
  path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  setenv("NOTIFY_SOCKET", path.c_str(), 1);

  options_.exit_at_end = true;
  app_.finished = true;
  app_.report.state = TrackingState::Tracking;
  Supervisor supervisor(options_);
  EXPECT_TRUE(supervisor.run(app_));

  unsetenv("NOTIFY_SOCKET");
  std::vector<std::string> notes;
  char buffer[4096];
  for (ssize_t n = recv(fd, buffer, sizeof(buffer), 0); n >= 0; n = recv(fd, buffer, sizeof(buffer), 0)) {
    notes.emplace_back(buffer, static_cast<std::size_t>(n));
  }
  close(fd);
  std::filesystem::remove(path);
  ASSERT_GE(notes.size(), 3U);
  EXPECT_EQ(notes[0], "READY=1\nSTATUS=running: fake app");
  EXPECT_EQ(notes[1], "STATUS=tracking");
  EXPECT_EQ(notes[2], "STOPPING=1\nSTATUS=stopping");
}

TEST_F(SupervisorTest, TakesSourceErrorsWithoutEverBlocking) {
  Supervisor supervisor(options_);
  const std::function<void(const Error&)> sink = supervisor.source_error_sink();
  for (int i = 0; i < 1000; ++i) {  // many more than are kept between two looks
    sink({ErrorCode::BadData, "rgb.txt:" + std::to_string(i)});
  }
  options_.exit_at_end = true;
  app_.on_start = [&] { kill(getpid(), SIGTERM); };
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(supervisor.run(app_));
  const std::string log = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(log.find("rgb.txt:999"), std::string::npos);
  EXPECT_EQ(log.find("rgb.txt:0\n"), std::string::npos);
  EXPECT_NE(log.find("984 more errors"), std::string::npos);
}

TEST_F(SupervisorTest, TheEnableLinePausesFromTheStartOnAndTheLightShowsIt) {
  FakeGpioLines gpio;
  gpio.enabled_now = false;
  app_.report.state = TrackingState::Tracking;
  bool paused_at_start = false;
  app_.on_start = [&] { paused_at_start = app_.paused; };
  int looks = 0;
  gpio.on_show = [&](LightState) {
    switch (++looks) {
      case 3: gpio.enabled_now = true; break;
      case 6: app_.report.source.connected = false; break;
      case 9: gpio.enabled_now = false; break;
      case 12: kill(getpid(), SIGTERM); break;
      default: break;
    }
  };
  Supervisor supervisor(options_);
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(supervisor.run(app_, &gpio));
  const std::string log = ::testing::internal::GetCapturedStderr();
  EXPECT_TRUE(paused_at_start);
  EXPECT_TRUE(app_.paused);
  EXPECT_EQ(gpio.shown,
            (std::vector<LightState>{LightState::Paused, LightState::Tracking, LightState::WaitingForCamera, LightState::Paused}));
  const std::size_t paused = log.find("paused by the enable line");
  const std::size_t running = log.find("running: the enable line is active");
  ASSERT_NE(paused, std::string::npos) << log;
  ASSERT_NE(running, std::string::npos) << log;
  EXPECT_LT(paused, running);
  EXPECT_NE(log.find("paused by the enable line", running), std::string::npos) << log;
}

TEST_F(SupervisorTest, WithoutLinesNothingIsPaused) {
  options_.exit_at_end = true;
  app_.finished = true;
  Supervisor supervisor(options_);
  ASSERT_TRUE(supervisor.run(app_));
  EXPECT_FALSE(app_.paused);
}

TEST_F(SupervisorTest, LogsWhatTheLinesTell) {
  Supervisor supervisor(options_);
  supervisor.gpio_error_sink()({ErrorCode::Unavailable, "line 3 is taken"});
  FakeGpioLines gpio;
  app_.report.gpio.ok = false;
  int looks = 0;
  gpio.on_show = [&](LightState) {
    ++looks;
    if (looks == 2) {
      app_.report.gpio.ok = true;
    } else if (looks == 4) {
      kill(getpid(), SIGTERM);
    }
  };
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(supervisor.run(app_, &gpio));
  const std::string log = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(log.find("gpio: line 3 is taken"), std::string::npos) << log;
  EXPECT_NE(log.find("gpio: waiting for a line"), std::string::npos) << log;
  EXPECT_NE(log.find("gpio: every line is held"), std::string::npos) << log;
}

TEST(LightState, FollowsTheReport) {
  HealthReport health;
  EXPECT_EQ(light_state(health), LightState::Initializing);
  health.state = TrackingState::Tracking;
  EXPECT_EQ(light_state(health), LightState::Tracking);
  health.state = TrackingState::Lost;
  EXPECT_EQ(light_state(health), LightState::Lost);
  health.state = TrackingState::Relocalizing;
  EXPECT_EQ(light_state(health), LightState::Lost);
  health.source_failed = true;
  EXPECT_EQ(light_state(health), LightState::WaitingForCamera);
  health.source_failed = false;
  health.source.connected = false;
  EXPECT_EQ(light_state(health), LightState::WaitingForCamera);
  health.paused = true;
  EXPECT_EQ(light_state(health), LightState::Paused);
}

TEST(DescribeHealth, TellsOfPausesAndLines) {
  HealthReport health;
  EXPECT_EQ(describe(health, 0).find("trigger"), std::string::npos);
  EXPECT_EQ(describe(health, 0).find("pause"), std::string::npos);
  health.paused = true;
  health.frames_paused = 7;
  health.gpio = {.ok = false, .trigger_pulses = 90, .trigger_missed = 2, .worst_trigger_lateness_ns = 250 * kNsPerUs};
  const std::string line = describe(health, 30);
  EXPECT_NE(line.find("initializing, paused, 30.0 frames/s"), std::string::npos) << line;
  EXPECT_NE(line.find("frames let go while paused 7"), std::string::npos) << line;
  EXPECT_NE(line.find("a GPIO line is missing"), std::string::npos) << line;
  EXPECT_NE(line.find("trigger pulses 90, missed 2, at most 0.250 ms late"), std::string::npos) << line;
}

TEST(DescribeHealth, NamesStateRateAndLosses) {
  HealthReport health;
  health.state = TrackingState::Tracking;
  health.source_failed = true;
  health.frames_tracked = 90;
  health.frames_lost = 10;
  health.frames_skipped = 1;
  health.frames_no_slot = 2;
  health.frames_missed = 8;
  health.frames_dropped = 4;
  const std::string line = describe(health, 29.97);
  EXPECT_NE(line.find("tracking, source failed, 30.0 frames/s"), std::string::npos) << line;
  EXPECT_NE(line.find("tracked 90, lost 10, not processed 15"), std::string::npos) << line;
}

TEST(ExitCode, TellsMistakesFromTroubles) {
  EXPECT_EQ(exit_code(ErrorCode::InvalidConfig), 78);
  EXPECT_EQ(exit_code(ErrorCode::InvalidArgument), 78);
  EXPECT_EQ(exit_code(ErrorCode::NotFound), 66);
  EXPECT_EQ(exit_code(ErrorCode::BadData), 65);
  EXPECT_EQ(exit_code(ErrorCode::Io), 74);
  EXPECT_EQ(exit_code(ErrorCode::Unavailable), 69);
  EXPECT_EQ(exit_code(ErrorCode::Unsupported), 69);
}

TEST(ExitCode, TheHelpListsEveryCodeThatIsUsed) {
  for (const ErrorCode code : {ErrorCode::InvalidArgument, ErrorCode::InvalidConfig, ErrorCode::NotFound, ErrorCode::BadData,
                               ErrorCode::Io, ErrorCode::Unavailable, ErrorCode::Unsupported}) {
    EXPECT_NE(exit_code_table().find("  " + std::to_string(exit_code(code)) + "  "), std::string_view::npos);
  }
}

}  // namespace
}  // namespace posed
