#include <algorithm>
#include <cstdint>
#include <latch>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/bounded_ring.h"
#include "tests/stress/payload.h"

namespace posed {
namespace {

class BoundedRingStress : public testing::TestWithParam<std::size_t> {};

TEST_P(BoundedRingStress, EveryElementArrivesOnceWholeAndInOrder) {
  // With room for one element each push and pop may cost a switch of threads, which a busy machine takes its time for.
  const std::uint64_t elements = 10'000 * std::min<std::uint64_t>(GetParam(), 4);
  BoundedRing<Payload> ring(GetParam());
  std::latch start(2);
  std::uint64_t torn = 0;
  std::uint64_t unexpected = 0;

  std::thread producer([&] {
    Dawdler dawdler(3);
    start.arrive_and_wait();
    for (std::uint64_t i = 1; i <= elements; ++i) {
      Payload* cell = ring.claim();
      while (cell == nullptr) {
        std::this_thread::yield();
        cell = ring.claim();
      }
      *cell = Payload(i);
      ring.commit();
      dawdler.step();
    }
  });
  std::thread consumer([&] {
    Dawdler dawdler(4);
    start.arrive_and_wait();
    for (std::uint64_t expected = 1; expected <= elements; ++expected) {
      const Payload* front = ring.front();
      while (front == nullptr) {
        std::this_thread::yield();
        front = ring.front();
      }
      unexpected += front->number() == expected ? 0 : 1;
      dawdler.step();  // the producer has time to spoil what is being read
      torn += front->is_whole() ? 0 : 1;
      ring.release();
    }
  });
  producer.join();
  consumer.join();

  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(unexpected, 0u);
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_EQ(ring.front(), nullptr);
}

INSTANTIATE_TEST_SUITE_P(Capacities, BoundedRingStress, testing::Values(1, 2, 5));

}  // namespace
}  // namespace posed
