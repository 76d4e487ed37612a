#include "slam/place_verifier.h"

#include <algorithm>
#include <optional>
#include <set>

#include <gtest/gtest.h>

#include "drivers/synthetic_camera.h"
#include "slam/mapper.h"
#include "slam/orb_extractor.h"
#include "tests/support/one_keyframe_map.h"

namespace posed {
namespace {

constexpr int kMinInliers = 40;

struct PlaceVerifierTest : OneKeyframeMap {
  PlaceVerifier verifier{camera, config};
  Se3 T_map_camera = Se3::exp((Vector6d() << 0.05, 0.15, -0.2, 0.3, 0.1, 0.2).finished());

  std::optional<PlaceMatch> verify(const FeatureFrame& frame, int min_inliers = kMinInliers) {
    return verifier.verify(map, map.keyframes.front(), frame, min_inliers);
  }
  FeatureFrame stored(const FeatureWorld::View& view, const std::vector<float>& depth_m) const {
    FeatureFrame f(camera, view.features.keypoints.size());
    f.place_stored(camera, view.features, view.ideal_pixels, depth_m);
    return f;
  }
  double error(const PlaceMatch& match) const { return (match.T_map_camera.inverse() * T_map_camera).log().norm(); }
};

TEST_F(PlaceVerifierTest, FindsThePoseAndTheLandmarksThatShowIt) {
  const auto view = world.view(T_map_camera, 0.5, 0.005);
  const FeatureFrame frame = world.frame(view);
  const auto match = verify(frame);
  ASSERT_TRUE(match);
  EXPECT_LT(error(*match), 0.005);
  EXPECT_GT(match->inliers, 150);
  EXPECT_EQ(match->matches.size(), static_cast<std::size_t>(match->inliers));
  EXPECT_GT(match->covered, 0.5);
  EXPECT_LE(match->covered, 1.0);
  // The error is one that the covariance allows: chi-squared with 6 degrees of freedom, 99.9 %.
  const Vector6d xi = (match->T_map_camera.inverse() * T_map_camera).log();
  EXPECT_LT(xi.dot(match->covariance.inverse() * xi), 22.5);
  std::set<LandmarkId> landmarks;
  int right = 0;
  for (const auto& [keypoint, landmark] : match->matches) {
    EXPECT_TRUE(landmarks.insert(landmark).second);
    const auto l = std::ranges::lower_bound(map.landmarks, landmark, {}, &SnapshotLandmark::id);
    ASSERT_EQ(l->id, landmark);
    right += world.point_of(l->descriptor) == view.seen[keypoint] ? 1 : 0;
  }
  EXPECT_GT(right, match->inliers * 99 / 100);
}

TEST_F(PlaceVerifierTest, AStoredKeyframeAsksLikeTheFrameItWas) {
  const auto view = world.view(T_map_camera, 0.5, 0.005);
  const auto live = verify(world.frame(view));
  const FeatureFrame frame = stored(view, view.depth_m);
  const auto again = verify(frame);
  ASSERT_TRUE(live && again);
  EXPECT_LT((live->T_map_camera.inverse() * again->T_map_camera).log().norm(), 0.003);
}

TEST_F(PlaceVerifierTest, WorksWithoutDepth) {
  const auto view = world.view(T_map_camera, 0.5, 0);
  const auto match = verify(stored(view, std::vector<float>(view.depth_m.size(), 0.0F)));
  ASSERT_TRUE(match);
  EXPECT_LT(error(*match), 0.01);
}

TEST_F(PlaceVerifierTest, WorksWithDepthAtAFewKeypoints) {
  const auto view = world.view(T_map_camera, 0.5, 0.005);
  std::vector<float> depth_m(view.depth_m.size(), 0.0F);
  for (std::size_t i = 0; i < depth_m.size(); i += 10) {
    depth_m[i] = view.depth_m[i];
  }
  const auto match = verify(stored(view, depth_m));
  ASSERT_TRUE(match);
  EXPECT_LT(error(*match), 0.01);
}

TEST_F(PlaceVerifierTest, RefusesAnotherPlaceAndNothingAtAll) {
  FeatureWorld other(99);
  EXPECT_FALSE(verify(other.frame(other.view(Se3())), 8));
  EXPECT_FALSE(verify(FeatureFrame(camera, 10), 8));
}

TEST_F(PlaceVerifierTest, RefusesTheSameFeaturesInAnotherOrder) {
  // Every descriptor is known, but what they show has been rearranged.
  auto view = world.view(T_map_camera, 0.5, 0.005);
  std::mt19937 random(5);
  std::shuffle(view.features.descriptors.begin(), view.features.descriptors.end(), random);
  EXPECT_FALSE(verify(stored(view, view.depth_m)));
  EXPECT_FALSE(verify(stored(view, std::vector<float>(view.depth_m.size(), 0.0F))));
}

TEST_F(PlaceVerifierTest, RefusesFewerInliersThanAskedFor) {
  const FeatureFrame frame = world.frame(world.view(T_map_camera, 0.5, 0.005));
  const auto match = verify(frame);
  ASSERT_TRUE(match);
  EXPECT_TRUE(verify(frame, match->inliers));
  EXPECT_FALSE(verify(frame, match->inliers + 1));
}

TEST_F(PlaceVerifierTest, AnswersAlikeEachTime) {
  const FeatureFrame frame = world.frame(world.view(T_map_camera, 0.5, 0.005));
  const auto first = verify(frame);
  PlaceVerifier fresh(camera, config);
  FeatureWorld other(99);
  verify(other.frame(other.view(Se3())));
  const auto second = verify(frame);
  const auto third = fresh.verify(map, map.keyframes.front(), frame, kMinInliers);
  ASSERT_TRUE(first && second && third);
  EXPECT_EQ(first->T_map_camera.translation(), second->T_map_camera.translation());
  EXPECT_EQ(first->T_map_camera.translation(), third->T_map_camera.translation());
  EXPECT_EQ(first->T_map_camera.rotation().coeffs(), third->T_map_camera.rotation().coeffs());
  EXPECT_EQ(first->matches, second->matches);
  EXPECT_EQ(first->matches, third->matches);
}

/// Features of rendered images: what extractor, noise and texture make of it.
struct RenderedRoom {
  explicit RenderedRoom(int seed) {
    SyntheticConfig config;
    config.seed = seed;
    config.people = 0;
    source = std::move(*SyntheticCamera::create(config, intrinsics));
  }
  FeatureFrame frame(std::uint64_t index) {
    const int w = intrinsics.width;
    const int h = intrinsics.height;
    std::vector<std::uint8_t> bgr(static_cast<std::size_t>(3 * w * h));
    std::vector<std::uint8_t> gray(static_cast<std::size_t>(w * h));
    std::vector<float> depth_m(gray.size());
    RgbdFrame f;
    f.bgr = {bgr.data(), w, h, 3 * w, 3};
    f.gray = {gray.data(), w, h, w, 1};
    f.depth_m = {depth_m.data(), w, h, w, 1};
    EXPECT_TRUE(source->render(index, f));
    FeatureFrame placed(PinholeCamera(intrinsics), 2000);
    OrbExtractor(TrackerConfig{}, w, h).extract(f.gray, placed.features());
    placed.place(PinholeCamera(intrinsics), f.depth_m);
    return placed;
  }
  CameraIntrinsics intrinsics;
  std::unique_ptr<SyntheticCamera> source;
};

TEST(PlaceVerifier, TellsRenderedRoomsApart) {
  RenderedRoom room(1);
  const FeatureFrame at_start = room.frame(100);
  KeyframeRecord record;
  record.id = 1;
  record.starts_map = true;
  record.map_id = 1;
  record.features = at_start.features();
  record.ideal_pixels = at_start.ideal_pixels();
  record.depth_m = at_start.depth_m();
  record.landmarks.assign(at_start.size(), kNoLandmark);
  const TrackerConfig config;
  Mapper mapper(config, MapperConfig{}, MapMode::Mapping, room.intrinsics);
  mapper.insert(record);
  MapSnapshot map;
  mapper.write_snapshot(map);

  PlaceVerifier verifier(PinholeCamera(room.intrinsics), config);
  const Se3 T_start_later = room.source->pose(100).inverse() * room.source->pose(120);
  const auto match = verifier.verify(map, map.keyframes.front(), room.frame(120), kMinInliers);
  ASSERT_TRUE(match);
  const Vector6d error = (match->T_map_camera.inverse() * T_start_later).log();
  EXPECT_LT(error.tail<3>().norm(), 0.02);
  EXPECT_LT(error.head<3>().norm(), 0.01);

  RenderedRoom other(2);
  for (const std::uint64_t index : {100U, 400U}) {
    EXPECT_FALSE(verifier.verify(map, map.keyframes.front(), other.frame(index), 15));
  }
}

}  // namespace
}  // namespace posed
