#include "slam/mapper.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "slam/drift_model.h"
#include "tests/support/feature_world.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

Se3 shifted(double x, double yaw_rad = 0) {
  return Se3::exp((Vector6d() << 0, yaw_rad, 0, x, 0, 0).finished());
}

struct MapperTest : testing::Test {
  FeatureWorld world{1};
  TrackerConfig tracker = [] {
    TrackerConfig t;
    t.close_depth_m = 10;
    return t;
  }();
  MapperConfig config;

  MapSnapshot snapshot_of(const Mapper& mapper) {
    MapSnapshot s;
    mapper.write_snapshot(s);
    return s;
  }

  /// Landmark id of every point that the snapshot holds.
  std::vector<LandmarkId> landmarks_by_point(const MapSnapshot& s) {
    std::vector<LandmarkId> ids(world.points().size(), kNoLandmark);
    for (const SnapshotLandmark& l : s.landmarks) {
      ids[world.point_of(l.descriptor)] = l.id;
    }
    return ids;
  }

  double mean_error_m(const MapSnapshot& s) {
    double sum = 0;
    for (const SnapshotLandmark& l : s.landmarks) {
      sum += (l.p_map.cast<double>() - world.points()[world.point_of(l.descriptor)]).norm();
    }
    return sum / static_cast<double>(s.landmarks.size());
  }
};

TEST_F(MapperTest, FirstKeyframeTurnsItsDepthsIntoLandmarks) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  const auto view = world.view(Se3());
  mapper.insert(FeatureWorld::record(view, 1, {}));
  const MapSnapshot s = snapshot_of(mapper);
  EXPECT_EQ(s.version, 1U);
  EXPECT_EQ(s.map_id, 1U);
  EXPECT_EQ(s.newest_keyframe, 1U);
  EXPECT_EQ(s.landmarks.size(), view.seen.size());
  EXPECT_TRUE(std::is_sorted(s.landmarks.begin(), s.landmarks.end(), [](const auto& a, const auto& b) { return a.id < b.id; }));
  EXPECT_LT(mean_error_m(s), 1e-3);
  ASSERT_EQ(s.keyframes.size(), 1U);
  EXPECT_EQ(s.keyframes[0].landmarks.size(), view.seen.size());
}

TEST_F(MapperTest, LeavesOutDepthsThatAreMissingOrFar) {
  tracker.close_depth_m = 2.5;
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  const auto view = world.view(Se3());
  KeyframeRecord record = FeatureWorld::record(view, 1, {});
  record.depth_m[0] = 0;
  mapper.insert(record);
  const auto near = std::count_if(record.depth_m.begin(), record.depth_m.end(), [](float z) { return z > 0 && z <= 2.5F; });
  EXPECT_EQ(mapper.landmark_count(), static_cast<std::size_t>(near));
}

TEST_F(MapperTest, RepeatedMeasurementsSharpenLandmarks) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  mapper.insert(FeatureWorld::record(world.view(Se3(), 1.0, 0.02), 1, {}));
  const double first = mean_error_m(snapshot_of(mapper));
  for (KeyframeId id = 2; id <= 12; ++id) {
    const auto view = world.view(shifted(0.02 * static_cast<double>(id)), 1.0, 0.02);
    mapper.insert(FeatureWorld::record(view, id, landmarks_by_point(snapshot_of(mapper))));
  }
  const MapSnapshot s = snapshot_of(mapper);
  EXPECT_LT(mean_error_m(s), 0.6 * first);
}

TEST_F(MapperTest, ForgetsLandmarksThatAreNotSeenAgain) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  const auto view = world.view(Se3());
  mapper.insert(FeatureWorld::record(view, 1, {}));
  // From the same place, none of the first keyframe's landmarks is matched any more: they were a mover's, say.
  const std::size_t before = mapper.landmark_count();
  for (KeyframeId id = 2; id <= 8; ++id) {
    KeyframeRecord record = FeatureWorld::record(view, id, {});
    std::fill(record.depth_m.begin(), record.depth_m.end(), 0.0F);
    mapper.insert(record);
  }
  EXPECT_LT(mapper.landmark_count(), before / 10);
}

TEST_F(MapperTest, WherePeopleAreAboutLandmarksMustBeSeenTwice) {
  const auto landmarks_after = [&](bool shows_movers) {
    Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
    const auto view = world.view(Se3());
    KeyframeRecord first = FeatureWorld::record(view, 1, {});
    first.shows_movers = shows_movers;
    mapper.insert(first);
    // Every second landmark of the first keyframe is found again, once; then the camera looks elsewhere.
    std::vector<LandmarkId> known = landmarks_by_point(snapshot_of(mapper));
    for (std::size_t i = 0; i < known.size(); i += 2) {
      known[i] = kNoLandmark;
    }
    for (KeyframeId id = 2; id <= 4; ++id) {
      KeyframeRecord next =
          FeatureWorld::record(id == 2 ? view : world.view(shifted(0, 3.0)), id, id == 2 ? known : std::vector<LandmarkId>{});
      std::fill(next.depth_m.begin(), next.depth_m.end(), 0.0F);
      mapper.insert(next);
    }
    return mapper.landmark_count();
  };
  const std::size_t all = landmarks_after(false);
  const std::size_t confirmed = landmarks_after(true);
  EXPECT_GT(all, 100U);
  EXPECT_LT(confirmed, 0.7 * static_cast<double>(all));
  EXPECT_GT(confirmed, 0.3 * static_cast<double>(all));
}

TEST_F(MapperTest, IgnoresMatchesWithLandmarksItHasCulled) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  mapper.insert(FeatureWorld::record(world.view(Se3()), 1, {}));
  const std::vector<LandmarkId> unknown(world.points().size(), 999'999);
  mapper.insert(FeatureWorld::record(world.view(shifted(0.05)), 2, unknown));
  EXPECT_EQ(mapper.keyframe_count(), 2U);
}

TEST_F(MapperTest, KeepsWithinItsBudgetsAndStillKnowsDroppedPoses) {
  config.max_keyframes = 8;
  config.local_keyframes = 4;
  config.local_landmarks = 300;
  config.recovery_keyframes = 5;
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  std::vector<Se3> poses;
  for (KeyframeId id = 1; id <= 30; ++id) {
    poses.push_back(shifted(0.03 * static_cast<double>(id)));
    mapper.insert(FeatureWorld::record(world.view(poses.back()), id, landmarks_by_point(snapshot_of(mapper))));
    const MapSnapshot s = snapshot_of(mapper);
    ASSERT_LE(mapper.keyframe_count(), 8U);
    ASSERT_LE(s.landmarks.size(), 300U);
    ASSERT_LE(s.keyframes.size(), 5U);
    for (const SnapshotKeyframe& k : s.keyframes) {
      ASSERT_TRUE(std::all_of(k.landmarks.begin(), k.landmarks.end(), [&](std::uint32_t l) { return l < s.landmarks.size(); }));
    }
  }
  for (KeyframeId id = 1; id <= 30; ++id) {
    const std::optional<Se3> pose = mapper.keyframe_pose(id);
    ASSERT_TRUE(pose) << id;
    EXPECT_LT((pose->inverse() * poses[id - 1]).log().norm(), 1e-9) << id;
  }
  EXPECT_FALSE(mapper.keyframe_pose(31));
  EXPECT_FALSE(mapper.keyframe_pose(kNoKeyframe));
}

TEST_F(MapperTest, ANewMapReplacesAYoungOneButKeepsItsPoses) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  mapper.insert(FeatureWorld::record(world.view(shifted(0.5)), 1, {}));
  const MapSnapshot old_map = snapshot_of(mapper);
  KeyframeRecord record = FeatureWorld::record(world.view(Se3()), 2, {});
  record.starts_map = true;
  record.map_id = 2;
  mapper.insert(record);
  const MapSnapshot s = snapshot_of(mapper);
  EXPECT_EQ(s.map_id, 2U);
  EXPECT_EQ(mapper.keyframe_count(), 1U);
  EXPECT_GT(s.landmarks.front().id, old_map.landmarks.back().id) << "an old landmark's id must not mean a new one";
  ASSERT_TRUE(mapper.keyframe_pose(1));
  EXPECT_LT((mapper.keyframe_pose(1)->inverse() * shifted(0.5)).log().norm(), 1e-9);
}

/// Whatever is left to do, without interruption.
void finish(Mapper& mapper) {
  while (mapper.improve({})) {
  }
}

TEST_F(MapperTest, ImprovesUntilNothingIsLeft) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  EXPECT_FALSE(mapper.improve({})) << "an empty map cannot be improved";
  for (KeyframeId id = 1; id <= 6; ++id) {
    const auto view = world.view(shifted(0.1 * static_cast<double>(id)), 1.0, 0.02);
    mapper.insert(FeatureWorld::record(view, id, landmarks_by_point(snapshot_of(mapper))));
    const std::uint64_t version = snapshot_of(mapper).version;
    finish(mapper);
    EXPECT_GT(snapshot_of(mapper).version, version);
    EXPECT_FALSE(mapper.improve({}));
  }
  EXPECT_EQ(mapper.counters().adjustments, 6U);
  EXPECT_EQ(mapper.counters().adjustments_given_up, 0U);
  EXPECT_LT(mean_error_m(snapshot_of(mapper)), 0.02);
}

TEST_F(MapperTest, AdjustmentBringsKeyframesNearerToTheTruth) {
  double before = 0;
  double after = 0;
  for (const bool adjusted : {false, true}) {
    config.bundle_keyframes = adjusted ? 20 : 0;
    Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
    double sum = 0;
    for (KeyframeId id = 1; id <= 8; ++id) {
      const Se3 truth = shifted(0.15 * static_cast<double>(id - 1));
      KeyframeRecord record = FeatureWorld::record(world.view(truth, 1.0, 0.01), id, landmarks_by_point(snapshot_of(mapper)));
      const Se3 error = Se3::exp(0.004 * Vector6d::Ones() * (id % 2 == 0 ? 1 : -1));
      record.T_map_camera = id == 1 ? truth : truth * error;
      record.T_map_odom = snapshot_of(mapper).T_map_odom;
      mapper.insert(record);
      finish(mapper);
    }
    for (KeyframeId id = 1; id <= 8; ++id) {
      sum += (mapper.keyframe_pose(id)->inverse() * shifted(0.15 * static_cast<double>(id - 1))).log().norm();
    }
    (adjusted ? after : before) = sum;
  }
  EXPECT_LT(after, 0.5 * before);
}

TEST_F(MapperTest, WhatIsInterruptedIsGivenUpAndTheMapStaysSound) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  for (KeyframeId id = 1; id <= 6; ++id) {
    const auto view = world.view(shifted(0.1 * static_cast<double>(id)), 1.0, 0.02);
    mapper.insert(FeatureWorld::record(view, id, landmarks_by_point(snapshot_of(mapper))));
    while (mapper.improve([] { return true; })) {
    }
  }
  EXPECT_EQ(mapper.counters().adjustments_given_up, 6U);
  for (KeyframeId id = 1; id <= 6; ++id) {
    ASSERT_TRUE(mapper.keyframe_pose(id)) << id;
    EXPECT_LT((mapper.keyframe_pose(id)->inverse() * shifted(0.1 * static_cast<double>(id))).log().norm(), 0.05) << id;
  }
  EXPECT_LT(mean_error_m(snapshot_of(mapper)), 0.05);
}

TEST_F(MapperTest, CorrectionsOfTheMapDoNotShowInOdom) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  for (KeyframeId id = 1; id <= 6; ++id) {
    KeyframeRecord record = FeatureWorld::record(world.view(shifted(0.1 * static_cast<double>(id)), 1.0, 0.02), id,
                                                 landmarks_by_point(snapshot_of(mapper)));
    record.T_map_odom = snapshot_of(mapper).T_map_odom;
    record.T_map_camera = record.T_map_odom * record.T_map_camera;
    mapper.insert(record);
    const auto in_odom = [&] { return snapshot_of(mapper).T_map_odom.inverse() * *mapper.keyframe_pose(id); };
    const Se3 before = in_odom();
    finish(mapper);
    EXPECT_LT((before.inverse() * in_odom()).log().norm(), 1e-9);
  }
  EXPECT_GT(snapshot_of(mapper).T_map_odom.log().norm(), 0.0) << "nothing was corrected, so nothing was tested";
}

TEST_F(MapperTest, AKeyframeFollowsWhatWasCorrectedSinceItWasTracked) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  mapper.insert(FeatureWorld::record(world.view(Se3()), 1, {}));
  const Se3 pose = shifted(0.1);
  KeyframeRecord record = FeatureWorld::record(world.view(pose), 2, landmarks_by_point(snapshot_of(mapper)));
  record.T_map_odom = shifted(0.7, 0.3);  // of the snapshot it was tracked against; the mapper's own is the identity by now
  record.T_map_camera = record.T_map_odom * pose;
  mapper.insert(record);
  EXPECT_LT((mapper.keyframe_pose(2)->inverse() * pose).log().norm(), 1e-9);
}

TEST_F(MapperTest, SavedMapsComeBackAndInLocalizationStayAsTheyAre) {
  const TemporaryFolder folder;
  const std::string file = folder / "map";
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  for (KeyframeId id = 1; id <= 6; ++id) {
    const auto view = world.view(shifted(0.1 * static_cast<double>(id)));
    mapper.insert(FeatureWorld::record(view, id, landmarks_by_point(snapshot_of(mapper))));
  }
  ASSERT_TRUE(mapper.save(file));

  Mapper loaded(tracker, config, MapMode::Localization, world.intrinsics);
  ASSERT_TRUE(loaded.load(file));
  EXPECT_EQ(loaded.keyframe_count(), mapper.keyframe_count());
  EXPECT_EQ(loaded.landmark_count(), mapper.landmark_count());
  const MapSnapshot s = snapshot_of(loaded);
  EXPECT_EQ(s.map_id, 1U);
  EXPECT_EQ(s.newest_keyframe, 6U) << "numbers go on";
  EXPECT_EQ(s.landmarks.size(), snapshot_of(mapper).landmarks.size());

  loaded.insert(FeatureWorld::record(world.view(shifted(0.1)), 7, landmarks_by_point(s)));
  EXPECT_FALSE(loaded.improve({}));
  EXPECT_EQ(loaded.keyframe_count(), mapper.keyframe_count());
  EXPECT_EQ(loaded.landmark_count(), mapper.landmark_count());
  EXPECT_EQ(snapshot_of(loaded).newest_keyframe, 7U) << "the tracker must not wait for it";
  EXPECT_EQ(snapshot_of(loaded).keyframes.front().id, 1U) << "the local map follows the camera";
}

TEST_F(MapperTest, AKeyframeOfOneMapStaysThereThoughTheCameraWasFoundInAnother) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  FeatureWorld elsewhere(2);
  KeyframeId id = 0;
  const auto insert = [&](FeatureWorld& place, std::uint32_t map_id, double x) {
    KeyframeRecord record = FeatureWorld::record(place.view(shifted(x)), ++id, {});
    record.map_id = map_id;
    record.starts_map = snapshot_of(mapper).newest_map_id < map_id;
    mapper.insert(record);
  };
  for (int i = 0; i < 6; ++i) {
    insert(world, 1, 0.1 * i);
  }
  for (int i = 0; i < 6; ++i) {
    insert(elsewhere, 2, 0.1 * i);
  }
  ASSERT_EQ(snapshot_of(mapper).map_id, 2U);

  // The tracker asks where it is, and finds its way back in map 2 before it learns of the answer.
  KeyframeRecord question = FeatureWorld::record(world.view(shifted(0.2)), kNoKeyframe, {});
  question.purpose = RecordPurpose::Relocalization;
  question.sequence = 77;
  mapper.insert(question);
  ASSERT_TRUE(snapshot_of(mapper).relocalization.found);
  EXPECT_EQ(snapshot_of(mapper).relocalization.sequence, 77U);
  EXPECT_LT((snapshot_of(mapper).relocalization.T_map_camera.inverse() * shifted(0.2)).log().norm(), 1e-2);
  EXPECT_EQ(snapshot_of(mapper).map_id, 1U);

  insert(elsewhere, 2, 0.7);
  EXPECT_EQ(snapshot_of(mapper).map_id, 2U);
}

TEST_F(MapperTest, AFileThatCannotBeLoadedChangesNothing) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  EXPECT_FALSE(mapper.load("/nowhere/map"));
  EXPECT_EQ(snapshot_of(mapper).version, 0U);
  mapper.insert(FeatureWorld::record(world.view(Se3()), 1, {}));
  EXPECT_EQ(mapper.keyframe_count(), 1U);
}

TEST_F(MapperTest, UncertaintyGrowsOnTheWayOutAndShrinksOnTheWayBack) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  // Along x, so far that the last view shows nothing of the first, and back.
  constexpr int kSteps = 12;
  constexpr double kStep_m = 0.3;
  constexpr double kVariance = 1e-6;  // of a keyframe, given its landmarks
  std::vector<double> variances_m2;
  for (int i = 0; i <= 2 * kSteps; ++i) {
    const Se3 T_map_camera = shifted(-1.8 + kStep_m * (i <= kSteps ? i : 2 * kSteps - i));
    const auto known = landmarks_by_point(snapshot_of(mapper));
    const auto view = world.view(T_map_camera);
    KeyframeRecord record = FeatureWorld::record(view, static_cast<KeyframeId>(i) + 1, known);
    record.covariance = i == 0 ? Matrix6d::Zero() : isotropic_covariance(kVariance, kVariance);
    mapper.insert(record);
    // What a frame from the same place inherits.
    const MapSnapshot s = snapshot_of(mapper);
    InheritedDrift inherited;
    for (const SnapshotLandmark& l : s.landmarks) {
      if (std::find(view.seen.begin(), view.seen.end(), world.point_of(l.descriptor)) != view.seen.end()) {
        const SnapshotAnchor& anchor = s.anchors[l.anchor];
        inherited.add(1, anchor.T_map_camera.inverse() * T_map_camera, anchor.covariance);
      }
    }
    const Matrix6d covariance = inherited.covariance(record.covariance);
    variances_m2.push_back(covariance.bottomRightCorner<3, 3>().trace());
  }
  const double out_m2 = variances_m2[kSteps];
  for (int i = 4; i <= kSteps; i += 4) {
    EXPECT_GT(variances_m2[static_cast<std::size_t>(i)], 1.2 * variances_m2[static_cast<std::size_t>(i) - 4]) << i;
  }
  // It hangs on a keyframe that does not see the first one's landmarks either.
  EXPECT_GE(out_m2, variances_m2.front() + 3 * 2 * config.drift_factor * kVariance);
  // What it measures itself comes on top: the first keyframe measures nothing.
  for (int i = 0; i <= kSteps; i += 4) {
    EXPECT_LT(variances_m2[static_cast<std::size_t>(2 * kSteps - i)],
              1.5 * variances_m2[static_cast<std::size_t>(i)] + 3 * kVariance)
        << i;
  }
}

TEST_F(MapperTest, SnapshotOfAnEmptyMapSaysSo) {
  Mapper mapper(tracker, config, MapMode::Mapping, world.intrinsics);
  const MapSnapshot s = snapshot_of(mapper);
  EXPECT_EQ(s.version, 0U);
  EXPECT_EQ(s.newest_keyframe, kNoKeyframe);
  EXPECT_TRUE(s.landmarks.empty());
  EXPECT_TRUE(s.keyframes.empty());
}

}  // namespace
}  // namespace posed
