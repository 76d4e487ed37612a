#include "daemon/stage_link.h"

#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

using IntLink = StageLink<OverflowRing<int>>;

TEST(StageLink, ConsumerSeesEverythingBeforeTheEnd) {
  constexpr int kCount = 20'000;
  IntLink link(kCount);
  std::vector<int> taken;
  std::jthread consumer([&](const std::stop_token& stop) {
    EXPECT_TRUE(link.consume(stop, [&] {
      const std::optional<int> value = link.ring.pop();
      if (value) {
        taken.push_back(*value);
      }
      return value.has_value();
    }));
  });
  for (int i = 0; i < kCount; ++i) {
    ASSERT_FALSE(link.ring.push(i));
    link.notify_arrived();
  }
  link.close();
  consumer.join();
  ASSERT_EQ(taken.size(), static_cast<std::size_t>(kCount));
  EXPECT_EQ(taken.back(), kCount - 1);
}

TEST(StageLink, AWaitingProducerLosesNothing) {
  constexpr int kCount = 20'000;
  IntLink link(2);
  std::jthread producer([&](const std::stop_token& stop) {
    for (int i = 0; i < kCount; ++i) {
      ASSERT_TRUE(link.wait_for_room(stop));
      ASSERT_FALSE(link.ring.push(i));
      link.notify_arrived();
    }
    link.close();
  });
  int expected = 0;
  const std::stop_source never;
  EXPECT_TRUE(link.consume(never.get_token(), [&] {
    const std::optional<int> value = link.ring.pop();
    if (value) {
      EXPECT_EQ(*value, expected++);
      link.notify_taken();
    }
    return value.has_value();
  }));
  EXPECT_EQ(expected, kCount);
}

TEST(StageLink, AStopEndsBothWaits) {
  IntLink full(1);
  ASSERT_FALSE(full.ring.push(1));
  IntLink empty(1);
  std::stop_source stop;
  std::optional<bool> got_room;
  std::optional<bool> drained;
  std::thread producer([&] { got_room = full.wait_for_room(stop.get_token()); });
  std::thread consumer([&] { drained = empty.consume(stop.get_token(), [] { return false; }); });
  stop.request_stop();
  full.wake_all();
  empty.wake_all();
  producer.join();
  consumer.join();
  EXPECT_EQ(got_room, false);
  EXPECT_EQ(drained, false);
}

}  // namespace
}  // namespace posed
