#include "core/latest_value.h"

#include <cstdint>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(LatestValue, IsDefaultConstructedBeforeTheFirstPublish) {
  LatestValue<int> latest;
  EXPECT_FALSE(latest.refresh());
  EXPECT_EQ(latest.front(), 0);
}

TEST(LatestValue, ShowsAValueOnceAsNew) {
  LatestValue<int> latest;
  latest.back() = 1;
  latest.publish();
  EXPECT_EQ(latest.front(), 0);  // not before the consumer asks
  EXPECT_TRUE(latest.refresh());
  EXPECT_EQ(latest.front(), 1);
  EXPECT_FALSE(latest.refresh());
  EXPECT_EQ(latest.front(), 1);
}

TEST(LatestValue, KeepsOnlyTheNewest) {
  LatestValue<int> latest;
  for (int i = 1; i <= 10; ++i) {
    latest.back() = i;
    latest.publish();
  }
  EXPECT_TRUE(latest.refresh());
  EXPECT_EQ(latest.front(), 10);
  EXPECT_FALSE(latest.refresh());
}

TEST(LatestValue, NeverChangesWhatTheConsumerReads) {
  LatestValue<int> latest;
  latest.back() = 1;
  latest.publish();
  latest.refresh();
  for (int i = 2; i < 20; ++i) {
    latest.back() = i;
    EXPECT_EQ(latest.front(), 1);
    latest.publish();
    EXPECT_EQ(latest.front(), 1);
  }
}

TEST(LatestValue, HidesAValueThatIsNotPublished) {
  LatestValue<int> latest;
  latest.back() = 1;
  EXPECT_FALSE(latest.refresh());
  EXPECT_EQ(latest.front(), 0);
}

TEST(LatestValue, PreparesItsValuesAndReusesThemForEver) {
  LatestValue<std::vector<int>> latest;
  int prepared = 0;
  latest.prepare([&](std::vector<int>& value) {
    value.reserve(50);
    ++prepared;
  });
  EXPECT_EQ(prepared, 3);
  std::set<const int*> buffers;
  for (int i = 0; i < 30; ++i) {
    latest.back().assign(50, i);
    latest.publish();
    if (i % 3 == 0) {
      EXPECT_TRUE(latest.refresh());
      buffers.insert(latest.front().data());
      EXPECT_EQ(latest.front().back(), i);
    }
  }
  EXPECT_LE(buffers.size(), 3u);
}

TEST(LatestValue, KeepsItsValuesOnCacheLinesOfTheirOwn) {
  LatestValue<std::uint8_t> latest;
  const auto before = reinterpret_cast<std::uintptr_t>(&latest.back());
  latest.publish();
  const auto after = reinterpret_cast<std::uintptr_t>(&latest.back());
  EXPECT_EQ(before % 64, 0u);
  EXPECT_EQ(after % 64, 0u);
  EXPECT_NE(before, after);
}

}  // namespace
}  // namespace posed
