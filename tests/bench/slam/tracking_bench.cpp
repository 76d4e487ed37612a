// What follows the extractor in a tracked frame: placing features, matching the local map, solving for the pose. The world is made
// of random points with random descriptors (tests/support/feature_world.h); some 2,200 are in view, twice what a frame of 1,000
// features has.
#include <benchmark/benchmark.h>

#include "slam/mapper.h"
#include "slam/measurement_noise.h"
#include "slam/pose_solver.h"
#include "slam/projection_matcher.h"
#include "tests/support/feature_world.h"

namespace posed {
namespace {

struct Scene {
  FeatureWorld world{1, 6500};
  TrackerConfig config = [] {
    TrackerConfig t;
    t.close_depth_m = 10;
    return t;
  }();
  PinholeCamera camera{world.intrinsics};
  Se3 T_map_camera = Se3::exp((Vector6d() << 0.02, 0.03, -0.01, 0.05, 0.02, 0.03).finished());
  FeatureWorld::View view = world.view(T_map_camera, 0.7, 0.005);
  FeatureFrame frame = world.frame(view);
  MapSnapshot map;

  Scene() {
    Mapper mapper(config, MapperConfig{}, MapMode::Mapping, world.intrinsics);
    mapper.insert(FeatureWorld::record(world.view(Se3(), 0.7, 0.005), 1, {}));
    mapper.write_snapshot(map);
  }

  std::vector<ProjectedLandmark> project(const ProjectionMatcher& matcher) const {
    std::vector<ProjectedLandmark> projected;
    matcher.project_where(
        map, T_map_camera, frame, [](std::uint32_t) { return true; }, projected);
    return projected;
  }
};

const Scene& scene() {
  static const Scene instance;
  return instance;
}

void BM_PlaceFeatures(benchmark::State& state) {
  const Scene& s = scene();
  FeatureFrame frame = s.frame;
  const ImageView<const float> depth{s.view.depth_image.data(), s.world.intrinsics.width, s.world.intrinsics.height,
                                     s.world.intrinsics.width, 1};
  for (auto _ : state) {
    frame.place(s.camera, depth);
    benchmark::DoNotOptimize(frame.depth_m().data());
  }
  state.counters["keypoints"] = static_cast<double>(frame.size());
}
BENCHMARK(BM_PlaceFeatures)->Unit(benchmark::kMicrosecond);

void BM_ProjectLandmarks(benchmark::State& state) {
  const ProjectionMatcher matcher(scene().camera, scene().config);
  std::size_t projected = 0;
  for (auto _ : state) {
    projected = scene().project(matcher).size();
    benchmark::DoNotOptimize(projected);
  }
  state.counters["landmarks"] = static_cast<double>(scene().map.landmarks.size());
  state.counters["in view"] = static_cast<double>(projected);
}
BENCHMARK(BM_ProjectLandmarks)->Unit(benchmark::kMicrosecond);

/// Search window's half side in pixels: 5 around the local map, 10 around last frame's landmarks.
void BM_MatchLandmarks(benchmark::State& state) {
  const Scene& s = scene();
  ProjectionMatcher matcher(s.camera, s.config);
  const std::vector<ProjectedLandmark> projected = s.project(matcher);
  MatchOptions options;
  options.radius = static_cast<float>(state.range(0));
  std::vector<std::int32_t> landmark_of;
  int matches = 0;
  for (auto _ : state) {
    landmark_of.assign(s.frame.size(), kUnmatched);
    matches = matcher.match(s.map, projected, s.frame, options, landmark_of);
  }
  state.counters["landmarks"] = static_cast<double>(projected.size());
  state.counters["matches"] = matches;
}
BENCHMARK(BM_MatchLandmarks)->Arg(5)->Arg(10)->Unit(benchmark::kMicrosecond);

/// Observations, from a start half a frame's motion away.
void BM_SolvePose(benchmark::State& state) {
  const Scene& s = scene();
  const MeasurementNoise noise(s.config, s.world.intrinsics);
  std::vector<PoseObservation> observations;
  for (std::size_t i = 0; i < s.frame.size() && observations.size() < static_cast<std::size_t>(state.range(0)); ++i) {
    const int level = s.frame.features().keypoints[i].level;
    const double z = s.frame.depth_m()[i];
    observations.push_back({s.world.points()[s.view.seen[i]], s.frame.ideal_pixels()[i].cast<double>(), s.frame.disparity()[i],
                            noise.pixel_weight(level), noise.disparity_weight(level, z), true});
  }
  const Se3 start = s.T_map_camera * Se3::exp((Vector6d() << 0.005, 0.005, 0.003, 0.01, 0.01, 0.005).finished());
  PoseSolution solution;
  for (auto _ : state) {
    std::vector<PoseObservation> fresh = observations;
    solution = solve_pose(s.camera, start, fresh);
    benchmark::DoNotOptimize(solution);
  }
  state.counters["inliers"] = solution.inliers;
}
BENCHMARK(BM_SolvePose)->Arg(200)->Arg(500)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace posed
