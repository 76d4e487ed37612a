#include "drivers/gpio/blink_pattern.h"

#include <utility>

#include <gtest/gtest.h>

namespace posed {
namespace {

std::vector<std::pair<TimeNs, bool>> changes_ms(const BlinkPattern& pattern, std::size_t count) {
  std::vector<std::pair<TimeNs, bool>> changes;
  TimeNs at_ns = 0;
  while (changes.size() < count && (at_ns = pattern.next_change_ns(at_ns)) != kNever_ns) {
    changes.emplace_back(at_ns / kNsPerMs, pattern.is_on(at_ns));
    EXPECT_NE(pattern.is_on(at_ns - 1), pattern.is_on(at_ns)) << at_ns;
  }
  return changes;
}

using Changes = std::vector<std::pair<TimeNs, bool>>;

TEST(BlinkPattern, AlternatesAndRepeats) {
  const BlinkPattern pattern({100, 200, 50, 650});
  EXPECT_TRUE(pattern.is_on(0));
  EXPECT_EQ(changes_ms(pattern, 6), (Changes{{100, false}, {300, true}, {350, false}, {1000, true}, {1100, false}, {1300, true}}));
}

TEST(BlinkPattern, ListsOfOddLengthJoinTheirEndToTheirBegin) {
  EXPECT_EQ(changes_ms(BlinkPattern({100, 200, 300}), 4), (Changes{{100, false}, {300, true}, {700, false}, {900, true}}));
}

TEST(BlinkPattern, OneNumberShinesAndNoneIsDark) {
  const BlinkPattern always({1000});
  const BlinkPattern never;
  for (const TimeNs at_ns : {TimeNs{0}, 999 * kNsPerMs, 1000 * kNsPerMs, 123'456 * kNsPerMs}) {
    EXPECT_TRUE(always.is_on(at_ns));
    EXPECT_FALSE(never.is_on(at_ns));
  }
  EXPECT_EQ(always.next_change_ns(5), kNever_ns);
  EXPECT_EQ(never.next_change_ns(5), kNever_ns);
}

TEST(BlinkPattern, StaysExactOverAYear) {
  const BlinkPattern pattern({50, 1950});
  const TimeNs year_ns = 365LL * 24 * 3600 * kNsPerSecond;  // a multiple of the round
  EXPECT_TRUE(pattern.is_on(year_ns));
  EXPECT_EQ(pattern.next_change_ns(year_ns), year_ns + 50 * kNsPerMs);
}

}  // namespace
}  // namespace posed
