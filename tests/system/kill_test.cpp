// The daemon is killed at any moment, again and again, while it saves its map all the time: the file is always a whole map.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "config/config_loader.h"
#include "slam/map_io.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

pid_t start_daemon(const std::string& config, const std::string& log) {
  const pid_t child = fork();
  if (child == 0) {
    const int fd = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    dup2(fd, STDERR_FILENO);
    dup2(fd, STDOUT_FILENO);
    execl(POSED_DAEMON, POSED_DAEMON, "--config", config.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  return child;
}

TEST(Kill, AMapThatIsSavedAllTheTimeIsAlwaysWhole) {
  const TemporaryFolder folder;
  const std::string map = folder / "map";
  const std::string log = folder / "log";
  const std::string config = folder.write("posed.toml", R"([detector]
enabled = false
[dynamic]
mode = "off"
[map]
file = ")" + map + R"("
save_period_s = 0.02
[publisher]
url = "memq://"
)");
  // More trials where somebody asks: POSED_KILL_TRIALS=200.
  const char* const asked = std::getenv("POSED_KILL_TRIALS");
  const int trials = asked != nullptr ? std::atoi(asked) : 8;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> lifetime_ms(300, 1500);
  const Config defaults = default_config().value();
  const MapHeader expected{.camera = defaults.intrinsics,
                           .pyramid_levels = defaults.tracker.pyramid_levels,
                           .pyramid_scale = defaults.tracker.pyramid_scale};
  int maps = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const pid_t child = start_daemon(config, log);
    ASSERT_GT(child, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(lifetime_ms(random)));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the daemon ended by itself:\n" << contents_of(log);
    if (!std::filesystem::exists(map)) {
      continue;  // killed before the first save
    }
    const Result<LoadedMap> loaded = load_map(map, expected);
    ASSERT_TRUE(loaded) << "trial " << trial << ": " << loaded.error().message;
    ++maps;
  }
  EXPECT_GT(maps, 0);
  RecordProperty("maps", maps);
}

}  // namespace
}  // namespace posed
