#include "core/overflow_ring.h"

#include <deque>
#include <memory>
#include <random>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(OverflowRing, IsEmptyAtFirst) {
  OverflowRing<int> ring(3);
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_EQ(ring.capacity(), 3u);
  EXPECT_EQ(ring.pop(), std::nullopt);
}

TEST(OverflowRing, KeepsTheOrder) {
  OverflowRing<int> ring(3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(ring.push(i), std::nullopt);
  }
  EXPECT_EQ(ring.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(ring.pop(), i);
  }
  EXPECT_EQ(ring.pop(), std::nullopt);
}

TEST(OverflowRing, HandsTheOldestBackWhenFull) {
  OverflowRing<int> ring(2);
  EXPECT_EQ(ring.push(1), std::nullopt);
  EXPECT_EQ(ring.push(2), std::nullopt);
  EXPECT_EQ(ring.push(3), 1);
  EXPECT_EQ(ring.push(4), 2);
  EXPECT_EQ(ring.size(), 2u);
  EXPECT_EQ(ring.pop(), 3);
  EXPECT_EQ(ring.push(5), std::nullopt);
  EXPECT_EQ(ring.pop(), 4);
  EXPECT_EQ(ring.pop(), 5);
}

TEST(OverflowRing, OfOneElementHoldsTheNewest) {
  OverflowRing<int> ring(1);
  EXPECT_EQ(ring.push(0), std::nullopt);
  for (int i = 1; i < 100; ++i) {
    EXPECT_EQ(ring.push(i), i - 1);
  }
  EXPECT_EQ(ring.pop(), 99);
}

TEST(OverflowRing, KeepsNoCopyOfWhatItGaveAway) {
  const auto counted = std::make_shared<int>(1);
  OverflowRing<std::shared_ptr<int>> ring(1);
  ring.push(counted);
  EXPECT_EQ(counted.use_count(), 2);
  ring.pop();
  EXPECT_EQ(counted.use_count(), 1);
  ring.push(counted);
  ring.push(nullptr);  // what it hands back is dropped here
  EXPECT_EQ(counted.use_count(), 1);
}

TEST(OverflowRing, CarriesElementsThatOnlyMove) {
  OverflowRing<std::unique_ptr<int>> ring(1);
  ring.push(std::make_unique<int>(1));
  const std::optional<std::unique_ptr<int>> oldest = ring.push(std::make_unique<int>(2));
  ASSERT_TRUE(oldest);
  EXPECT_EQ(**oldest, 1);
  EXPECT_EQ(**ring.pop(), 2);
}

TEST(OverflowRing, AgreesWithADequeOverRandomOperations) {
  std::mt19937 random(7);
  for (const std::size_t capacity : {1u, 2u, 3u, 5u, 64u}) {
    OverflowRing<int> ring(capacity);
    std::deque<int> expected;
    for (int i = 0; i < 20'000; ++i) {
      if (random() % 5 < 3) {
        std::optional<int> oldest;
        if (expected.size() == capacity) {
          oldest = expected.front();
          expected.pop_front();
        }
        expected.push_back(i);
        ASSERT_EQ(ring.push(i), oldest);
      } else {
        std::optional<int> front;
        if (!expected.empty()) {
          front = expected.front();
          expected.pop_front();
        }
        ASSERT_EQ(ring.pop(), front);
      }
      ASSERT_EQ(ring.size(), expected.size());
    }
  }
}

}  // namespace
}  // namespace posed
