#include "slam/mover_table.h"

#include <gtest/gtest.h>

#include "core/clock.h"

namespace posed {
namespace {

constexpr double kMemory_s = 1.5;
constexpr std::int64_t kStart = 1000 * kNsPerSecond;
constexpr float kSureScore = 0.9F;
constexpr float kPlainScore = 0.4F;

std::int64_t after(double seconds) {
  return kStart + from_seconds(seconds);
}

/// As many cells for each, so that none dies for want of them.
MoverTable::PerMover<std::size_t> all_seen() {
  MoverTable::PerMover<std::size_t> area{};
  area.fill(100);
  return area;
}

/// The same evidence for everyone.
MoverTable::PerMover<MoverEvidence> everywhere(std::size_t moved, std::size_t was_there) {
  MoverTable::PerMover<MoverEvidence> evidence{};
  evidence.fill({.cells = 100, .moved = moved, .was_there = was_there});
  return evidence;
}

/// A person of whom the detector is sure and one of whom it is not, after its first look at them.
struct TwoPeople {
  MoverTable movers{kMemory_s};
  std::uint8_t sure = movers.add(kStart);
  std::uint8_t unsure = movers.add(kStart);

  TwoPeople() {
    movers.looked();
    movers.found(sure, kSureScore, kStart);
    movers.found(unsure, kPlainScore, kStart);
  }
};

TEST(MoverTable, NumbersAreFromOneOnAndEndWithTheLabels) {
  MoverTable movers(kMemory_s);
  for (std::size_t i = 1; i <= kMostMovers; ++i) {
    EXPECT_EQ(movers.add(kStart), i);
  }
  EXPECT_EQ(movers.add(kStart), 0);
  EXPECT_FALSE(movers[0].alive);
}

TEST(MoverTable, ANumberIsFreeAgainAfterADeath) {
  MoverTable movers(kMemory_s);
  movers.add(kStart);
  const std::uint8_t second = movers.add(kStart);
  movers.add(kStart);
  MoverTable::PerMover<std::size_t> area = all_seen();
  area[second] = MoverTable::kLeastCells - 1;
  EXPECT_TRUE(movers.forget(area, kStart));
  EXPECT_FALSE(movers[second].alive);
  EXPECT_EQ(movers.add(kStart), second);
}

TEST(MoverTable, WhatNothingConfirmsIsForgottenAfterItsMemory) {
  MoverTable movers(kMemory_s);
  const std::uint8_t id = movers.add(kStart);
  EXPECT_FALSE(movers.forget(all_seen(), after(kMemory_s)));
  movers.moved(id, after(1));
  EXPECT_FALSE(movers.forget(all_seen(), after(1 + kMemory_s)));
  EXPECT_TRUE(movers.forget(all_seen(), after(1.1 + kMemory_s)));
}

TEST(MoverTable, TheMemoryOfAPersonWhomTheDetectorWasSureOfIsLonger) {
  auto [movers, sure, unsure] = TwoPeople();
  EXPECT_TRUE(movers[sure].sure);
  EXPECT_FALSE(movers[unsure].sure);
  EXPECT_TRUE(movers.forget(all_seen(), after(1.5 * kMemory_s)));
  EXPECT_TRUE(movers[sure].alive);
  EXPECT_FALSE(movers[unsure].alive);
}

TEST(MoverTable, PlainLooksAddUpUnlessTooManyMissBetween) {
  MoverTable movers(kMemory_s);
  const std::uint8_t seen_each_time = movers.add(kStart);
  const std::uint8_t seen_now_and_then = movers.add(kStart);
  for (int look = 0; look < 20; ++look) {
    movers.looked();
    movers.found(seen_each_time, kPlainScore, kStart);
    if (look % 5 == 0) {
      movers.found(seen_now_and_then, kPlainScore, kStart);
    }
  }
  EXPECT_TRUE(movers[seen_each_time].sure);
  EXPECT_FALSE(movers[seen_now_and_then].sure);
}

TEST(MoverTable, APersonWhomTheDetectorIsNotSureOfIsLetGoWhereAllWasThereBefore) {
  auto [movers, sure, unsure] = TwoPeople();
  movers.judge(everywhere(0, 80), kStart);
  EXPECT_TRUE(movers[sure].masked);
  EXPECT_FALSE(movers[unsure].masked);
  movers.judge(everywhere(0, 60), kStart);
  EXPECT_TRUE(movers[unsure].masked);
}

TEST(MoverTable, WhoIsLetGoAndMissedDies) {
  auto [movers, sure, id] = TwoPeople();
  movers.judge(everywhere(0, 80), kStart);
  for (int look = 0; look < 10 && movers[id].alive; ++look) {
    movers.looked();
    movers.forget(all_seen(), kStart);
  }
  EXPECT_FALSE(movers[id].alive);
}

TEST(MoverTable, MotionConfirmsAndMasksAgain) {
  auto [movers, sure, id] = TwoPeople();
  movers.judge(everywhere(0, 80), after(1));
  EXPECT_FALSE(movers[id].moving);
  movers.judge(everywhere(10, 80), after(1));
  EXPECT_TRUE(movers[id].moving);
  EXPECT_TRUE(movers[id].masked);
  EXPECT_FALSE(movers.forget(all_seen(), after(1 + kMemory_s)));
}

TEST(MoverTable, AFifthOfTheCellsMovingIsWalking) {
  EXPECT_TRUE((MoverEvidence{.cells = 100, .moved = 21}.walks()));
  EXPECT_FALSE((MoverEvidence{.cells = 100, .moved = 20}.walks()));
  EXPECT_FALSE((MoverEvidence{.cells = 8, .moved = 6}.walks()));
}

TEST(MoverTable, OnePersonForAllReplacesEverybody) {
  MoverTable movers(kMemory_s);
  movers.add(kStart);
  movers.add(kStart);
  movers.assign_person(1, kStart);
  int alive = 0;
  movers.for_each([&alive](const Mover& mover) { alive += mover.person && mover.sure && mover.masked ? 1 : 0; });
  EXPECT_EQ(alive, 1);
  EXPECT_FALSE(movers[2].alive);
}

}  // namespace
}  // namespace posed
