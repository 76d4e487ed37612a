#include "core/bounded_ring.h"

#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(BoundedRing, IsEmptyAtFirst) {
  BoundedRing<int> ring(2);
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_EQ(ring.capacity(), 2u);
  EXPECT_EQ(ring.front(), nullptr);
}

TEST(BoundedRing, RefusesWhenFullAndKeepsTheOrder) {
  BoundedRing<int> ring(2);
  for (const int value : {1, 2}) {
    int* const cell = ring.claim();
    ASSERT_NE(cell, nullptr);
    *cell = value;
    ring.commit();
  }
  EXPECT_EQ(ring.claim(), nullptr);
  EXPECT_EQ(ring.size(), 2u);

  EXPECT_EQ(*ring.front(), 1);
  ring.release();
  ASSERT_NE(ring.claim(), nullptr);
  EXPECT_EQ(*ring.front(), 2);
  ring.release();
  EXPECT_EQ(ring.front(), nullptr);
}

TEST(BoundedRing, ShowsNothingOfAClaimThatIsNotCommitted) {
  BoundedRing<int> ring(2);
  int* const cell = ring.claim();
  *cell = 5;
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_EQ(ring.claim(), cell);  // claiming again is not a second claim
  ring.commit();
  EXPECT_EQ(ring.front(), cell);
}

TEST(BoundedRing, ElementsKeepTheirBuffersFromUseToUse) {
  BoundedRing<std::vector<int>> ring(2);
  ring.prepare([](std::vector<int>& cell) { cell.reserve(100); });
  for (int round = 0; round < 7; ++round) {
    std::vector<int>* const cell = ring.claim();
    ASSERT_NE(cell, nullptr);
    EXPECT_GE(cell->capacity(), 100u);
    cell->assign(100, round);
    ring.commit();
    EXPECT_EQ(ring.front()->at(99), round);
    ring.release();
  }
}

}  // namespace
}  // namespace posed
