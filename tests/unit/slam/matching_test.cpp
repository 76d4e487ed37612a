#include <algorithm>
#include <optional>

#include <gtest/gtest.h>

#include "slam/keyframe_recovery.h"
#include "slam/projection_matcher.h"
#include "tests/support/one_keyframe_map.h"

namespace posed {
namespace {

struct MatchingTest : OneKeyframeMap {
  ProjectionMatcher matcher{camera, config};
  Se3 T_map_camera = Se3::exp((Vector6d() << 0.02, 0.05, -0.1, 0.2, 0.1, 0.15).finished());

  std::vector<ProjectedLandmark> project_all(const FeatureFrame& frame, const Se3& pose) const {
    std::vector<ProjectedLandmark> projected;
    matcher.project_where(
        map, pose, frame, [](std::uint32_t) { return true; }, projected);
    return projected;
  }

  /// Share of matches that join a keypoint with the landmark of the point it shows.
  double precision(const FeatureWorld::View& view, const std::vector<std::int32_t>& landmark_of) const {
    int right = 0;
    int all = 0;
    for (std::size_t i = 0; i < landmark_of.size(); ++i) {
      if (landmark_of[i] != kUnmatched) {
        ++all;
        right += world.point_of(map.landmarks[static_cast<std::size_t>(landmark_of[i])].descriptor) == view.seen[i] ? 1 : 0;
      }
    }
    return all == 0 ? 0.0 : static_cast<double>(right) / all;
  }
};

TEST_F(MatchingTest, FindsLandmarksWhereTheyProject) {
  const auto view = world.view(T_map_camera, 0.5, 0.005);
  const FeatureFrame frame = world.frame(view);
  const auto projected = project_all(frame, T_map_camera);
  std::vector<std::int32_t> landmark_of(frame.size(), kUnmatched);
  const int matches = matcher.match(map, projected, frame, MatchOptions{}, landmark_of);
  EXPECT_EQ(matches, std::count_if(landmark_of.begin(), landmark_of.end(), [](auto l) { return l != kUnmatched; }));
  EXPECT_GT(matches, static_cast<int>(projected.size() * 8 / 10));
  EXPECT_GT(precision(view, landmark_of), 0.99);
}

TEST_F(MatchingTest, GivesEachKeypointOneLandmarkAndKeepsWhatWasMatched) {
  const auto view = world.view(T_map_camera);
  const FeatureFrame frame = world.frame(view);
  auto projected = project_all(frame, T_map_camera);
  projected.insert(projected.end(), projected.begin(), projected.end());  // every landmark asks twice
  std::vector<std::int32_t> landmark_of(frame.size(), kUnmatched);
  landmark_of[0] = 7;
  matcher.match(map, projected, frame, MatchOptions{}, landmark_of);
  EXPECT_EQ(landmark_of[0], 7);
}

TEST_F(MatchingTest, RefusesDescriptorsThatDiffer) {
  auto view = world.view(T_map_camera);
  for (Descriptor& d : view.features.descriptors) {
    for (std::uint64_t& word : d) {
      word = ~word;
    }
  }
  const FeatureFrame frame = world.frame(view);
  std::vector<std::int32_t> landmark_of(frame.size(), kUnmatched);
  EXPECT_EQ(matcher.match(map, project_all(frame, T_map_camera), frame, MatchOptions{}, landmark_of), 0);
}

TEST_F(MatchingTest, RefusesDepthThatContradictsTheLandmark) {
  auto view = world.view(T_map_camera);
  for (float& z : view.depth_image) {
    z *= 0.3F;  // somebody stands in front of everything
  }
  const FeatureFrame frame = world.frame(view);
  std::vector<std::int32_t> landmark_of(frame.size(), kUnmatched);
  const auto projected = project_all(frame, T_map_camera);
  EXPECT_LT(matcher.match(map, projected, frame, MatchOptions{}, landmark_of), static_cast<int>(projected.size() / 50));
}

TEST_F(MatchingTest, ProjectsNothingThatCannotBeSeen) {
  const FeatureFrame frame = world.frame(world.view(Se3()));
  const auto turned = Se3::exp((Vector6d() << 0, 3.14, 0, 0, 0, 0).finished());
  EXPECT_TRUE(project_all(frame, turned).empty());
  // From behind the landmarks, looking back: in view, but never seen from that side.
  const Se3 behind = Se3::exp((Vector6d() << 0, 0, 0, 0, 0, 8).finished()) * turned;
  EXPECT_TRUE(project_all(frame, behind).empty());
}

TEST_F(MatchingTest, RecoveryFindsTheCameraWithoutAPrediction) {
  KeyframeRecovery recovery(camera, config);
  const Se3 far = Se3::exp((Vector6d() << 0.1, 0.2, 0.5, 0.4, -0.2, 0.3).finished());
  const FeatureFrame frame = world.frame(world.view(far, 0.5, 0.005));
  const auto recovered = recovery.recover(map, map.keyframes.front(), frame, 15);
  ASSERT_TRUE(recovered);
  EXPECT_LT((recovered->T_map_camera.inverse() * far).log().norm(), 0.01);
  EXPECT_GT(recovered->inliers, 50);
}

TEST_F(MatchingTest, RecoveryWorksWithHalfOfTheMatchesWrong) {
  auto view = world.view(T_map_camera, 0.5, 0.005);
  // Swap the descriptors of neighbours: they match well, and wrongly.
  for (std::size_t i = 0; i + 3 < view.features.descriptors.size(); i += 4) {
    std::swap(view.features.descriptors[i], view.features.descriptors[i + 1]);
  }
  KeyframeRecovery recovery(camera, config);
  const auto recovered = recovery.recover(map, map.keyframes.front(), world.frame(view), 15);
  ASSERT_TRUE(recovered);
  EXPECT_LT((recovered->T_map_camera.inverse() * T_map_camera).log().norm(), 0.01);
}

TEST_F(MatchingTest, RecoveryRefusesAnotherPlace) {
  FeatureWorld other(99);
  KeyframeRecovery recovery(camera, config);
  EXPECT_FALSE(recovery.recover(map, map.keyframes.front(), other.frame(other.view(Se3())), 15));
  EXPECT_FALSE(recovery.recover(map, map.keyframes.front(), FeatureFrame(camera, 10), 15));
}

}  // namespace
}  // namespace posed
