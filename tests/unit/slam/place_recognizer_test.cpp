#include "slam/place_recognizer.h"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

using Descriptors = std::vector<Descriptor>;

struct PlaceRecognizerTest : testing::Test {
  std::mt19937_64 random{7};
  PlaceRecognizer index;

  Descriptors place(std::size_t count = 400) {
    Descriptors d(count);
    for (Descriptor& x : d) {
      x = {random(), random(), random(), random()};
    }
    return d;
  }
  /// The same place again: `flips` bits of each descriptor differ, every third descriptor is another.
  Descriptors seen_again(const Descriptors& place, int flips = 20) {
    Descriptors d = place;
    for (std::size_t i = 0; i < d.size(); ++i) {
      for (int f = 0; f < flips; ++f) {
        const std::uint64_t bit = random() % 256;
        d[i][bit / 64] ^= 1ULL << (bit % 64);
      }
      if (i % 3 == 0) {
        d[i] = {random(), random(), random(), random()};
      }
    }
    return d;
  }
  std::vector<PlaceCandidate> ask(const Descriptors& d, std::size_t most = 5) const {
    std::vector<PlaceCandidate> found;
    index.query(
        d, most, [](KeyframeId) { return true; }, found);
    return found;
  }
};

TEST_F(PlaceRecognizerTest, AnEmptyIndexKnowsNothing) {
  EXPECT_EQ(index.size(), 0U);
  EXPECT_TRUE(ask(place()).empty());
}

TEST_F(PlaceRecognizerTest, FindsEachOfManyPlacesFirst) {
  std::vector<Descriptors> places;
  for (KeyframeId k = 1; k <= 200; ++k) {
    places.push_back(place());
    index.add(k, places.back());
  }
  EXPECT_EQ(index.size(), 200U);
  for (KeyframeId k = 1; k <= 200; ++k) {
    const auto found = ask(seen_again(places[k - 1]));
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().keyframe, k);
    EXPECT_TRUE(found.size() == 1 || found[1].score < 0.1 * found[0].score);
  }
}

TEST_F(PlaceRecognizerTest, ScoresAreSharesOfTheQuery) {
  const Descriptors here = place();
  index.add(1, here);
  EXPECT_EQ(ask(here).front().score, 1.0);
  // Half of the query is from somewhere else.
  Descriptors half = place(here.size() / 2);
  half.insert(half.end(), here.begin(), here.begin() + static_cast<std::ptrdiff_t>(here.size() / 2));
  EXPECT_NEAR(ask(half).front().score, 0.5, 0.01);
  EXPECT_TRUE(ask(place()).empty() || ask(place()).front().score < 0.01);
}

TEST_F(PlaceRecognizerTest, WhatEveryKeyframeHasCountsLittle) {
  const Descriptors wallpaper = place(200);
  const Descriptors painting = place(40);
  for (KeyframeId k = 1; k <= 50; ++k) {
    Descriptors d = k == 9 ? place(100) : wallpaper;
    if (k == 9) {
      d.insert(d.end(), painting.begin(), painting.end());
    }
    index.add(k, d);
  }
  Descriptors query = wallpaper;
  query.insert(query.end(), painting.begin(), painting.end());
  EXPECT_EQ(ask(query).front().keyframe, 9U);
}

TEST_F(PlaceRecognizerTest, AsksWhetherAKeyframeMayBeAnAnswer) {
  const Descriptors here = place();
  for (KeyframeId k = 1; k <= 10; ++k) {
    index.add(k, here);
  }
  std::vector<PlaceCandidate> found;
  index.query(
      here, 3, [](KeyframeId k) { return k % 2 == 0; }, found);
  // All are equally good: ties go to the smaller id.
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].keyframe, 2U);
  EXPECT_EQ(found[1].keyframe, 4U);
  EXPECT_EQ(found[2].keyframe, 6U);
  index.query(
      here, 3, [](KeyframeId) { return false; }, found);
  EXPECT_TRUE(found.empty());
}

TEST_F(PlaceRecognizerTest, ForgetsWhatIsRemoved) {
  const Descriptors here = place();
  index.add(1, here);
  index.add(2, place());
  index.remove(1);
  index.remove(1);
  index.remove(77);
  EXPECT_EQ(index.size(), 1U);
  EXPECT_TRUE(std::ranges::none_of(ask(here), [](const auto& c) { return c.keyframe == 1; }));
  index.clear();
  EXPECT_EQ(index.size(), 0U);
  EXPECT_TRUE(ask(here).empty());
  index.add(3, here);
  EXPECT_EQ(ask(here).front().keyframe, 3U);
}

TEST_F(PlaceRecognizerTest, AddingAgainReplaces) {
  const Descriptors before = place();
  const Descriptors after = place();
  index.add(1, before);
  index.add(1, after);
  EXPECT_EQ(index.size(), 1U);
  EXPECT_TRUE(ask(before).empty() || ask(before).front().score < 0.01);
  EXPECT_EQ(ask(after).front().score, 1.0);
}

TEST_F(PlaceRecognizerTest, AnswersDependOnContentsAlone) {
  std::vector<Descriptors> places;
  for (int k = 0; k < 60; ++k) {
    // Neighbours share half of what they show.
    Descriptors d = place(200);
    if (k > 0) {
      std::copy_n(places.back().begin(), 100, d.begin() + 100);
    }
    places.push_back(d);
  }
  PlaceRecognizer other;
  for (KeyframeId k = 1; k <= 60; ++k) {
    index.add(k, places[k - 1]);
  }
  for (KeyframeId k = 60; k >= 1; --k) {
    other.add(1000 + k, places[(k * 7) % 60]);
    other.add(k, places[k - 1]);
  }
  for (KeyframeId k = 1; k <= 60; ++k) {
    other.remove(1000 + k);
  }
  for (const Descriptors& p : places) {
    const Descriptors query = seen_again(p);
    std::vector<PlaceCandidate> found;
    other.query(
        query, 100, [](KeyframeId) { return true; }, found);
    EXPECT_EQ(ask(query, 100), found);
  }
}

TEST_F(PlaceRecognizerTest, MemoryIsBoundedByWhatIsIn) {
  // Many descriptors of few keys, as repeated texture gives.
  const auto alike = [&] { return seen_again(Descriptors(400, Descriptor{1, 2, 3, 4}), 3); };
  for (KeyframeId k = 1; k <= 100; ++k) {
    index.add(k, k % 2 == 0 ? place() : alike());
  }
  for (KeyframeId k = 101; k <= 300; ++k) {
    index.remove(k - 100);
    index.add(k, k % 2 == 0 ? place() : alike());
  }
  const std::size_t settled = index.memory_bytes();
  for (KeyframeId k = 301; k <= 600; ++k) {
    index.remove(k - 100);
    index.add(k, k % 2 == 0 ? place() : alike());
  }
  EXPECT_EQ(index.size(), 100U);
  EXPECT_LE(index.memory_bytes(), settled + settled / 10);
}

TEST_F(PlaceRecognizerTest, ACrowdedKeyframeIsThinnedEvenly) {
  const Descriptors many = place(4 * PlaceRecognizer::kMaxDescriptors);
  index.add(1, many);
  const auto quarter = static_cast<std::ptrdiff_t>(PlaceRecognizer::kMaxDescriptors);
  for (std::ptrdiff_t begin = 0; begin < 4 * quarter; begin += quarter) {
    EXPECT_NEAR(ask(Descriptors(many.begin() + begin, many.begin() + begin + quarter)).front().score, 0.25, 0.02);
  }
}

}  // namespace
}  // namespace posed
