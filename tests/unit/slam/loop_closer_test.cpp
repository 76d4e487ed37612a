#include "slam/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "slam/mapper.h"
#include "tests/support/feature_world.h"

namespace posed {
namespace {

constexpr KeyframeId kLinked = 3;  // newest keyframes whose landmarks a new one is matched with
constexpr double kHalfSide_m = 2.0;
constexpr double kStep_m = 0.4;
constexpr int kCornerSteps = 6;

std::vector<Eigen::Vector3d> points_between(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int count, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double x = share(generator);
    const double y = share(generator);
    const double z = share(generator);
    points.push_back(low + Eigen::Vector3d(x, y, z).cwiseProduct(high - low));
  }
  return points;
}

/// Points all around a square on the floor (y is down) that the camera goes round, looking outwards.
FeatureWorld square_world() {
  std::vector<Eigen::Vector3d> points = points_between({-6, -2, -6}, {6, 2, 6}, 7000, 1);
  std::erase_if(points, [](const Eigen::Vector3d& p) { return std::max(std::abs(p.x()), std::abs(p.z())) < kHalfSide_m + 1.5; });
  FeatureWorld world(1, std::move(points));
  world.range_m = 5;
  return world;
}

Se3 at(double x, double z, double yaw_rad) {
  return Se3(exp_so3({0, yaw_rad, 0}), {x, 0, z});
}

/// The way: along each side, then turning on the spot at its end. Camera z, the direction of view, is outwards.
std::vector<Se3> square_way(int sides) {
  std::vector<Se3> way;
  const int steps = static_cast<int>(std::lround(2 * kHalfSide_m / kStep_m));
  for (int side = 0; side < sides; ++side) {
    const Se3 T_world_side = at(0, 0, side * std::numbers::pi / 2);
    for (int i = 0; i < steps; ++i) {
      way.push_back(T_world_side * at(-kHalfSide_m + i * kStep_m, kHalfSide_m, 0));
    }
    for (int i = 0; i < kCornerSteps; ++i) {
      way.push_back(T_world_side * at(kHalfSide_m, kHalfSide_m, i * std::numbers::pi / 2 / kCornerSteps));
    }
  }
  const Se3 T_start_world = way.front().inverse();
  for (Se3& pose : way) {
    pose = T_start_world * pose;
  }
  return way;
}

/// A mapper that is handed keyframes as a tracker would that sees the last few keyframes' landmarks alone, and that drifts.
class DriftingWalk {
 public:
  DriftingWalk(const FeatureWorld& world, const Se3& T_world_start, const Vector6d& drift_a_step, MapperConfig config = {})
      : world_(world), T_world_start_(T_world_start), drift_(Se3::exp(drift_a_step)) {
    TrackerConfig tracker;
    tracker.close_depth_m = 10;
    config.bundle_keyframes = 0;  // it would take the drift out of every step, since the measurements have none
    mapper_.emplace(tracker, config, MapMode::Mapping, world_.intrinsics);
  }

  /// Takes the next keyframe, whose true pose is given in the first one's frame; true where that closed a loop.
  bool step(const Se3& truth) {
    const auto view = world_.view(T_world_start_ * truth, 0, 0, 0);
    KeyframeRecord record = FeatureWorld::record(view, ++id_, {});
    record.T_map_odom = before_.T_map_odom;
    record.T_map_camera = id_ == 1 ? truth : *mapper_->keyframe_pose(id_ - 1) * (truth_.inverse() * truth) * drift_;
    link(record);
    truth_ = truth;
    const std::uint64_t closed = mapper_->counters().loops_closed;
    mapper_->insert(record);
    T_odom_newest_ = before_.T_map_odom.inverse() * record.T_map_camera;
    error_before_m_ = (record.T_map_camera.translation() - truth.translation()).norm();
    while (mapper_->improve({})) {
    }
    mapper_->write_snapshot(before_);
    return mapper_->counters().loops_closed > closed;
  }

  double error_m(KeyframeId id, const Se3& truth) const {
    return (mapper_->keyframe_pose(id)->translation() - truth.translation()).norm();
  }
  double error_before_m() const { return error_before_m_; }  ///< of the newest keyframe as it was handed over
  const Se3& T_odom_newest() const { return T_odom_newest_; }
  const MapSnapshot& snapshot() const { return before_; }
  const Mapper& mapper() const { return *mapper_; }

 private:
  void link(KeyframeRecord& record) const {
    std::map<Descriptor, LandmarkId> known;
    for (const SnapshotKeyframe& keyframe : before_.keyframes) {
      if (keyframe.id + kLinked >= id_) {
        for (const std::uint32_t landmark : keyframe.landmarks) {
          known.emplace(before_.landmarks[landmark].descriptor, before_.landmarks[landmark].id);
        }
      }
    }
    for (std::size_t i = 0; i < record.landmarks.size(); ++i) {
      const auto found = known.find(record.features.descriptors[i]);
      record.landmarks[i] = found == known.end() ? kNoLandmark : found->second;
    }
  }

  FeatureWorld world_;
  Se3 T_world_start_;
  Se3 drift_;
  std::optional<Mapper> mapper_;
  MapSnapshot before_;
  Se3 truth_;
  Se3 T_odom_newest_;
  double error_before_m_ = 0;
  KeyframeId id_ = 0;
};

struct DriftedSquare : testing::Test {
  std::vector<Se3> way = square_way(5);
  DriftingWalk walk{square_world(), at(-kHalfSide_m, kHalfSide_m, 0), (Vector6d() << 0, 0.0005, 0, 0.003, 0.004, 0.003).finished()};

  /// Goes on until a loop is closed, and gives the index of the keyframe that closed it; way.size() where none did.
  std::size_t go_until_closed() {
    std::size_t i = 0;
    while (i < way.size() && !walk.step(way[i])) {
      ++i;
    }
    return i;
  }
};

TEST_F(DriftedSquare, IsClosedWhereTheCameraComesRound) {
  const std::size_t round = 4 * way.size() / 5;
  const std::size_t closed_at = go_until_closed();
  ASSERT_GE(closed_at, round - kCornerSteps) << "where the start comes into view";
  ASSERT_LT(closed_at, round + 8);
  EXPECT_GT(walk.error_before_m(), 0.15) << "there was something to correct";
  EXPECT_LT(walk.error_m(closed_at + 1, way[closed_at]), 0.2 * walk.error_before_m());
  double worst_m = 0;
  for (std::size_t i = 0; i <= closed_at; ++i) {
    worst_m = std::max(worst_m, walk.error_m(i + 1, way[i]));
  }
  EXPECT_LT(worst_m, walk.error_before_m()) << "the correction is spread over the way";
  EXPECT_EQ(walk.mapper().counters().loops_implausible, 0U);
}

TEST_F(DriftedSquare, ClosingMovesTheCameraInTheMapButNotInOdom) {
  const std::size_t closed_at = go_until_closed();
  ASSERT_LT(closed_at, way.size());
  const Se3 T_map_newest = *walk.mapper().keyframe_pose(closed_at + 1);
  const Se3 T_odom_newest = walk.snapshot().T_map_odom.inverse() * T_map_newest;
  EXPECT_LT((T_odom_newest.inverse() * walk.T_odom_newest()).log().norm(), 1e-9);
  EXPECT_GT(walk.snapshot().T_map_odom.log().tail<3>().norm(), 0.1) << "all of the correction is here";
}

TEST_F(DriftedSquare, GoesOnFromTheOldLandmarks) {
  const std::size_t closed_at = go_until_closed();
  ASSERT_LT(closed_at, way.size());
  const std::size_t landmarks = walk.mapper().landmark_count();
  const double corrected_m = walk.error_m(closed_at + 1, way[closed_at]);
  for (std::size_t i = closed_at + 1; i < closed_at + 4; ++i) {
    walk.step(way[i]);
    EXPECT_LT(walk.error_m(i + 1, way[i]), corrected_m + 0.05);
  }
  EXPECT_LT(walk.mapper().landmark_count(), landmarks + 150) << "what comes into view was mapped in the first round";
}

/// A wall of 18 m that shows between 5 and 9 m what it shows between -3 and 1, and further on something else.
FeatureWorld repeating_wall() {
  FeatureWorld world(1, points_between({-3, -2, 1.5}, {1, 2, 4}, 1200, 2));
  world.repeat({8, 0, 0});
  for (const double x : {1.0, 9.0}) {
    for (const Eigen::Vector3d& p : points_between({x, -2, 1.5}, {x + 4, 2, 4}, 1200, 3)) {
      world.add(p);
    }
  }
  return world;
}

TEST(LoopCloser, RefusesAPlaceThatOnlyLooksTheSame) {
  DriftingWalk walk(repeating_wall(), at(-1, 0, 0), Vector6d::Zero());
  int steps = 0;
  for (; steps < 39; ++steps) {
    EXPECT_FALSE(walk.step(at(0.25 * steps, 0, 0)));
  }
  EXPECT_EQ(walk.mapper().counters().loops_closed, 0U);
  EXPECT_GE(walk.mapper().counters().loops_implausible, 3U) << "appearance and geometry do agree";
  EXPECT_LT(walk.error_m(39, at(9.5, 0, 0)), 1e-3) << "nothing has been moved";
}

TEST(LoopCloser, RefusesItHoweverFarTheCameraHasTravelledInAMapThatHoldsTogether) {
  MapperConfig config;
  config.loop_max_drift = 0.3;  // 2.4 m on the 8 m between the places, but 8 m on a path of 26
  DriftingWalk walk(repeating_wall(), at(-1, 0, 0), Vector6d::Zero(), config);
  double worst_m = 0;
  KeyframeId id = 0;
  for (int pass = 0; pass < 4; ++pass) {
    for (int i = 0; i < 32; ++i) {
      const Se3 truth = at(0.3 * (pass % 2 == 0 ? i : 31 - i), 0, 0);
      walk.step(truth);
      worst_m = std::max(worst_m, walk.error_m(++id, truth));
    }
  }
  EXPECT_GE(walk.mapper().counters().loops_implausible, 3U);
  EXPECT_LT(worst_m, 0.05);
}

}  // namespace
}  // namespace posed
