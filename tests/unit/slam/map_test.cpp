#include "slam/map.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace posed {
namespace {

KeyframeRecord record(KeyframeId id, std::size_t keypoints = 3) {
  KeyframeRecord r;
  r.id = id;
  r.features.keypoints.resize(keypoints);
  r.features.descriptors.resize(keypoints);
  r.ideal_pixels.resize(keypoints);
  r.depth_m.resize(keypoints);
  r.landmarks.resize(keypoints, 42);  // the record's own links are not the map's
  return r;
}

TEST(Map, AddsKeyframesWithoutLinks) {
  Map map;
  map.add_keyframe(record(1));
  ASSERT_NE(map.find_keyframe(1), nullptr);
  for (const LandmarkId id : map.find_keyframe(1)->landmarks) {
    EXPECT_EQ(id, kNoLandmark);
  }
}

TEST(Map, LinksBothWays) {
  Map map;
  map.add_keyframe(record(1));
  const LandmarkId id = map.add_landmark({});
  map.observe(id, 1, 2);
  EXPECT_EQ(map.find_keyframe(1)->landmarks[2], id);
  ASSERT_EQ(map.find_landmark(id)->observations.size(), 1U);
  EXPECT_EQ(map.find_landmark(id)->observations[0].keyframe, 1U);
  EXPECT_EQ(map.find_landmark(id)->observations[0].keypoint, 2U);
}

TEST(Map, RemovingALandmarkUnlinksItEverywhere) {
  Map map;
  map.add_keyframe(record(1));
  map.add_keyframe(record(2));
  const LandmarkId id = map.add_landmark({});
  map.observe(id, 1, 0);
  map.observe(id, 2, 1);
  map.remove_landmark(id);
  EXPECT_EQ(map.find_landmark(id), nullptr);
  EXPECT_EQ(map.find_keyframe(1)->landmarks[0], kNoLandmark);
  EXPECT_EQ(map.find_keyframe(2)->landmarks[1], kNoLandmark);
  map.remove_landmark(id);  // twice does no harm
}

TEST(Map, RemovingAKeyframeTakesOnlyItsOwnLandmarksWithIt) {
  Map map;
  map.add_keyframe(record(1));
  map.add_keyframe(record(2));
  const LandmarkId shared = map.add_landmark({});
  const LandmarkId own = map.add_landmark({});
  map.observe(shared, 1, 0);
  map.observe(shared, 2, 0);
  map.observe(own, 1, 1);
  map.remove_keyframe(1);
  EXPECT_EQ(map.find_keyframe(1), nullptr);
  EXPECT_EQ(map.find_landmark(own), nullptr);
  ASSERT_NE(map.find_landmark(shared), nullptr);
  EXPECT_EQ(map.find_landmark(shared)->observations.size(), 1U);
  EXPECT_EQ(map.landmark_count(), 1U);
}

TEST(Map, NeverReusesALandmarkId) {
  Map map;
  const LandmarkId first = map.add_landmark({});
  map.clear();
  EXPECT_GT(map.add_landmark({}), first);
  EXPECT_EQ(map.landmark_count(), 1U);
}

}  // namespace
}  // namespace posed
