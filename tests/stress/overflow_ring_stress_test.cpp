#include <atomic>
#include <cstdint>
#include <latch>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/overflow_ring.h"
#include "tests/stress/payload.h"

namespace posed {
namespace {

/// What one side received, checked as it comes: whole, and in the order of pushing.
struct Received {
  std::vector<std::uint64_t> numbers;
  int torn = 0;
  int out_of_order = 0;

  void add(const Payload& payload) {
    torn += payload.is_whole() ? 0 : 1;
    out_of_order += !numbers.empty() && payload.number() <= numbers.back() ? 1 : 0;
    numbers.push_back(payload.number());
  }
};

class OverflowRingStress : public testing::TestWithParam<std::size_t> {};

TEST_P(OverflowRingStress, EveryElementIsEitherPoppedOrHandedBackOnceAndInOrder) {
  constexpr std::uint64_t kElements = 100'000;
  OverflowRing<Payload> ring(GetParam());
  std::latch start(2);
  std::atomic<bool> produced{false};
  Received handed_back;
  Received popped;

  std::thread producer([&] {
    Dawdler dawdler(1);
    start.arrive_and_wait();
    for (std::uint64_t i = 1; i <= kElements; ++i) {
      if (const std::optional<Payload> oldest = ring.push(Payload(i))) {
        handed_back.add(*oldest);
      }
      dawdler.step();
    }
    produced.store(true, std::memory_order_release);
  });
  std::thread consumer([&] {
    Dawdler dawdler(2);
    start.arrive_and_wait();
    while (true) {
      const bool last_round = produced.load(std::memory_order_acquire);  // read before the ring is found empty
      while (const std::optional<Payload> value = ring.pop()) {
        popped.add(*value);
        dawdler.step();
      }
      if (last_round) {
        return;
      }
      std::this_thread::yield();
    }
  });
  producer.join();
  consumer.join();

  for (const Received* side : {&handed_back, &popped}) {
    EXPECT_EQ(side->torn, 0);
    EXPECT_EQ(side->out_of_order, 0);
  }
  std::vector<int> times(kElements + 1, 0);
  for (const Received* side : {&handed_back, &popped}) {
    for (const std::uint64_t number : side->numbers) {
      ASSERT_LE(number, kElements);
      ++times[number];
    }
  }
  for (std::uint64_t i = 1; i <= kElements; ++i) {
    ASSERT_EQ(times[i], 1) << "element " << i;
  }
  EXPECT_EQ(popped.numbers.back(), kElements);  // the newest is never the one handed back
  EXPECT_EQ(ring.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Capacities, OverflowRingStress, testing::Values(1, 2, 7, 64));

}  // namespace
}  // namespace posed
