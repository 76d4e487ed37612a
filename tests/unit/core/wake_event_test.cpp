#include "core/wake_event.h"

#include <atomic>
#include <limits>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr TimeNs kForEver = std::numeric_limits<TimeNs>::max();

TEST(WakeEvent, ANotifyMovesTheGenerationOn) {
  WakeEvent event;
  const std::uint32_t seen = event.generation();
  event.notify();
  EXPECT_NE(event.generation(), seen);
}

TEST(WakeEvent, ANotifyBeforeTheWaitIsNotLost) {
  WakeEvent event;
  const std::uint32_t seen = event.generation();
  event.notify();
  EXPECT_TRUE(event.wait(seen, kForEver));  // returns at once, or never
  EXPECT_TRUE(event.wait(seen, 0));
}

TEST(WakeEvent, GivesUpWhenTheTimeIsOver) {
  WakeEvent event;
  const TimeNs start_ns = SystemClock::instance().now_ns();
  EXPECT_FALSE(event.wait(event.generation(), 2 * kNsPerMs));
  EXPECT_GE(SystemClock::instance().now_ns() - start_ns, 2 * kNsPerMs);
  EXPECT_FALSE(event.wait(event.generation(), 0));
  EXPECT_FALSE(event.wait(event.generation(), -kNsPerSecond));
}

TEST(WakeEvent, WakesEveryoneWhoWaits) {
  WakeEvent event;
  const std::uint32_t seen = event.generation();
  std::atomic<int> woken{0};
  std::vector<std::thread> sleepers;
  for (int i = 0; i < 3; ++i) {
    sleepers.emplace_back([&] {
      if (event.wait(seen, kForEver)) {
        woken.fetch_add(1);
      }
    });
  }
  event.notify();
  for (std::thread& sleeper : sleepers) {
    sleeper.join();
  }
  EXPECT_EQ(woken.load(), 3);
}

TEST(WakeEvent, LosesNoNotifyBetweenTwoThreadsThatTakeTurns) {
  // Each side goes on only when the other has notified: one lost wake-up and the test hangs until its time-out.
  WakeEvent ping;
  WakeEvent pong;
  constexpr int kTurns = 5'000;
  std::uint32_t pong_seen = pong.generation();
  std::thread other([&ping, &pong, ping_seen = ping.generation()]() mutable {
    for (int i = 0; i < kTurns; ++i) {
      while (!ping.wait(ping_seen, kForEver)) {
      }
      ping_seen = ping.generation();
      pong.notify();
    }
  });
  int turns = 0;
  for (; turns < kTurns; ++turns) {
    ping.notify();
    while (!pong.wait(pong_seen, kForEver)) {
    }
    pong_seen = pong.generation();
  }
  other.join();
  EXPECT_EQ(turns, kTurns);
}

}  // namespace
}  // namespace posed
