#include "detect/rung_ladder.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr TimeNs kMs = kNsPerMs;

/// Three rungs of 5, 12 and 28 ms, 33 ms each frame.
RungLadder ladder() {
  return RungLadder({5 * kMs, 12 * kMs, 28 * kMs}, 33 * kMs);
}

void run(RungLadder& l, double load, int frames) {
  constexpr double kUnloaded_ms[] = {5, 12, 28};
  for (int i = 0; i < frames; ++i) {
    const std::size_t rung = l.rung();
    const auto takes = static_cast<TimeNs>(load * kUnloaded_ms[rung] * static_cast<double>(kMs));
    if (takes <= 33 * kMs) {
      l.record_finished(rung, takes);
    } else {
      l.record_abandoned(rung, 33 * kMs);
    }
  }
}

TEST(RungLadder, BeginsWithTheLargestThatFitsUnloaded) {
  EXPECT_EQ(ladder().rung(), 2U);
  EXPECT_EQ(RungLadder({5 * kMs, 12 * kMs, 40 * kMs}, 33 * kMs).rung(), 1U);
  EXPECT_EQ(RungLadder({50 * kMs}, 33 * kMs).rung(), 0U) << "the cheapest where none fits";
}

TEST(RungLadder, GoesDownUnderLoadAndComesBack) {
  RungLadder l = ladder();
  run(l, 1.0, 40);
  EXPECT_EQ(l.rung(), 2U);
  run(l, 2.0, 40);  // 56 ms, 24 ms, 10 ms
  EXPECT_EQ(l.rung(), 1U);
  run(l, 4.0, 40);  // 48 ms, 20 ms
  EXPECT_EQ(l.rung(), 0U);
  run(l, 1.0, 40);
  EXPECT_EQ(l.rung(), 2U) << "without a trial of the larger ones";
}

TEST(RungLadder, ASingleHiccupChangesNothing) {
  RungLadder l = ladder();
  run(l, 1.0, 40);
  l.record_abandoned(2, 33 * kMs);
  EXPECT_EQ(l.rung(), 2U);
  run(l, 1.0, 5);
  l.record_abandoned(2, 33 * kMs);
  EXPECT_EQ(l.rung(), 1U) << "but one in ten frames is more than one in twenty";
}

TEST(RungLadder, DoesNotFlutterAtTheEdge) {
  RungLadder l = ladder();
  run(l, 1.25, 40);  // 35 ms: down
  EXPECT_EQ(l.rung(), 1U);
  run(l, 1.12, 100);  // 31.4 ms would fit, but for the margin
  EXPECT_EQ(l.rung(), 1U);
  run(l, 1.02, 100);
  EXPECT_EQ(l.rung(), 2U);
}

TEST(RungLadder, ExpectsOfEveryRungWhatOneShows) {
  RungLadder l = ladder();
  for (int i = 0; i < 32; ++i) {
    l.record_finished(0, i < 30 ? 6 * kMs : 10 * kMs);
  }
  EXPECT_EQ(l.expected_p95_ns(0), 10 * kMs);
  EXPECT_EQ(l.expected_p95_ns(1), 24 * kMs);
}

}  // namespace
}  // namespace posed
