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

/// Three keyframes in a row; 1 and 2 share two landmarks, 2 and 3 one.
struct ChainedMap : testing::Test {
  Map map;
  LandmarkId first = 0, second = 0, third = 0;

  void SetUp() override {
    for (KeyframeId id = 1; id <= 3; ++id) {
      KeyframeRecord r = record(id);
      r.map_id = 1;
      map.add_keyframe(r).parent = id - 1;
    }
    first = map.add_landmark({});
    second = map.add_landmark({});
    third = map.add_landmark({});
    map.observe(first, 1, 0);
    map.observe(first, 2, 0);
    map.observe(second, 1, 1);
    map.observe(second, 2, 1);
    map.observe(third, 2, 2);
    map.observe(third, 3, 2);
  }
  int shared(KeyframeId a, KeyframeId b) const {
    const auto& covisible = map.find_keyframe(a)->covisible;
    const auto it = covisible.find(b);
    return it == covisible.end() ? 0 : it->second;
  }
};

TEST_F(ChainedMap, CountsSharedLandmarksBothWays) {
  EXPECT_EQ(shared(1, 2), 2);
  EXPECT_EQ(shared(2, 1), 2);
  EXPECT_EQ(shared(2, 3), 1);
  EXPECT_EQ(shared(1, 3), 0);
  EXPECT_EQ(map.covisible_keyframes(2, 1, 10), (std::vector<KeyframeId>{1, 3})) << "most shared first";
  EXPECT_EQ(map.covisible_keyframes(2, 2, 10), (std::vector<KeyframeId>{1}));
  EXPECT_EQ(map.covisible_keyframes(2, 1, 1), (std::vector<KeyframeId>{1}));
}

TEST_F(ChainedMap, CountsFollowWhateverIsTakenAway) {
  map.forget_observation(first, 2);
  EXPECT_EQ(shared(1, 2), 1);
  EXPECT_EQ(map.find_keyframe(2)->landmarks[0], kNoLandmark);
  map.remove_landmark(second);
  EXPECT_EQ(shared(1, 2), 0);
  EXPECT_FALSE(map.find_keyframe(1)->covisible.contains(2)) << "what shares nothing is no neighbour";
  map.remove_keyframe(3);
  EXPECT_EQ(shared(2, 3), 0);
  EXPECT_TRUE(map.find_keyframe(2)->covisible.empty());
}

TEST_F(ChainedMap, ForgettingTheLastObservationRemovesTheLandmark) {
  map.forget_observation(third, 2);
  map.forget_observation(third, 3);
  EXPECT_EQ(map.find_landmark(third), nullptr);
  map.forget_observation(third, 3);  // twice does no harm
}

TEST_F(ChainedMap, MergedLandmarksAreSeenByAllThatSawEither) {
  map.merge_landmarks(third, first);  // keyframe 2 saw both: its observation of the one that stays holds
  EXPECT_EQ(map.find_landmark(third), nullptr);
  ASSERT_NE(map.find_landmark(first), nullptr);
  EXPECT_EQ(map.find_landmark(first)->observations.size(), 3U);
  EXPECT_EQ(map.find_keyframe(2)->landmarks[0], first);
  EXPECT_EQ(map.find_keyframe(2)->landmarks[2], kNoLandmark);
  EXPECT_EQ(map.find_keyframe(3)->landmarks[2], first);
  EXPECT_EQ(shared(1, 3), 1);
  EXPECT_EQ(shared(2, 3), 1);
  map.merge_landmarks(first, first);
  EXPECT_EQ(map.find_landmark(first)->observations.size(), 3U) << "a landmark is not its own duplicate";
}

TEST_F(ChainedMap, TheTreeStaysATreeWhenKeyframesGo) {
  map.remove_keyframe(2);
  EXPECT_EQ(map.find_keyframe(3)->parent, 1U);
  map.remove_keyframe(1);
  EXPECT_EQ(map.find_keyframe(3)->parent, kNoKeyframe);
}

TEST_F(ChainedMap, TheOldestChildOfARootThatGoesInheritsTheOthers) {
  map.find_keyframe(3)->parent = 1;
  map.remove_keyframe(1);
  EXPECT_EQ(map.find_keyframe(2)->parent, kNoKeyframe);
  EXPECT_EQ(map.find_keyframe(3)->parent, 2U);
}

TEST_F(ChainedMap, LoopsToAKeyframeGoWithIt) {
  map.find_keyframe(3)->loops.push_back({1, Se3(), Matrix6d::Identity()});
  map.remove_keyframe(1);
  EXPECT_TRUE(map.find_keyframe(3)->loops.empty());
}

TEST_F(ChainedMap, JoiningMovesOneMapIntoTheFrameOfTheOther) {
  KeyframeRecord other = record(4);
  other.map_id = 2;
  other.T_map_camera = Se3(Eigen::Quaterniond::Identity(), {0, 0, 1});
  map.add_keyframe(other);
  Landmark landmark;
  landmark.p_map = {1, 0, 0};
  landmark.mean_view_map = {1, 0, 0};
  landmark.information = Eigen::Vector3d(1, 2, 3).asDiagonal();
  const LandmarkId id = map.add_landmark(landmark);
  map.observe(id, 4, 0);

  const Se3 T_1_2(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {5, 0, 0});
  map.join(2, 1, T_1_2);
  EXPECT_EQ(map.find_keyframe(4)->map_id, 1U);
  EXPECT_LT((map.find_keyframe(4)->T_map_camera.translation() - Eigen::Vector3d(5, 0, 1)).norm(), 1e-12);
  EXPECT_LT((map.find_landmark(id)->p_map - Eigen::Vector3d(5, 1, 0)).norm(), 1e-12);
  EXPECT_LT((map.find_landmark(id)->mean_view_map - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_NEAR(map.find_landmark(id)->information(0, 0), 2, 1e-12);
  EXPECT_EQ(map.find_landmark(first)->p_map, Eigen::Vector3d::Zero()) << "the other map stays where it is";
}

TEST_F(ChainedMap, ARestoredKeyframeHasItsLinksAgain) {
  Map restored;
  for (const LandmarkId id : map.landmark_ids()) {
    restored.restore_landmark(id, *map.find_landmark(id));
  }
  for (const auto& [id, keyframe] : map.keyframes()) {
    restored.restore_keyframe(id, keyframe);
  }
  EXPECT_EQ(restored.find_keyframe(2)->covisible, map.find_keyframe(2)->covisible);
  EXPECT_EQ(restored.find_landmark(third)->observations.size(), 2U);
  EXPECT_GT(restored.add_landmark({}), third);
}

TEST(Map, NeverReusesALandmarkId) {
  Map map;
  const LandmarkId first = map.add_landmark({});
  map.remove_landmark(first);
  EXPECT_GT(map.add_landmark({}), first);
  EXPECT_EQ(map.landmark_count(), 1U);
}

}  // namespace
}  // namespace posed
