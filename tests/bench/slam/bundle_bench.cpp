// Bundle adjustment at the size of a local map (25 free and 25 fixed cameras) and of a whole one (500 cameras), by our solver and
// by Ceres, on the same problems: two rounds of at most five (local) or ten (whole map) iterations.
#include <benchmark/benchmark.h>

#include "slam/bundle_adjuster.h"
#include "tests/support/bundle_scene.h"
#include "tests/support/ceres_bundle.h"

namespace posed {
namespace {

struct Size {
  const char* name;
  BundleSceneOptions scene;
  BundleOptions options;
};

const PinholeCamera kCamera{CameraIntrinsics{}};
const Size kLocal{"local",
                  {.cameras = 50,
                   .fixed_cameras = 25,
                   .points = 3450,
                   .rounds = 0.3,
                   .observations_per_point = 7,
                   .outlier_share = 0.03,
                   .pose_error = 0.005,
                   .point_error = 0.02},
                  {.max_iterations = 5}};
const Size kWhole{"whole",
                  {.cameras = 500,
                   .points = 49500,
                   .rounds = 1.95,
                   .radius_m = 12,
                   .observations_per_point = 6,
                   .outlier_share = 0.03,
                   .pose_error = 0.02,
                   .point_error = 0.05},
                  {.max_iterations = 10}};

const BundleScene& scene(const Size& size) {
  static const BundleScene local = make_bundle_scene(kCamera, kLocal.scene);
  static const BundleScene whole = make_bundle_scene(kCamera, kWhole.scene);
  return &size == &kLocal ? local : whole;
}

void report(benchmark::State& state, const BundleProblem& problem, int iterations) {
  state.counters["cameras"] = static_cast<double>(problem.cameras.size());
  state.counters["points"] = static_cast<double>(problem.points.size());
  state.counters["observations"] = static_cast<double>(problem.observations.size());
  state.counters["iterations"] = iterations;
}

void BM_Own(benchmark::State& state, const Size& size) {
  BundleAdjuster adjuster(kCamera);
  BundleProblem problem;
  BundleSummary summary;
  for (auto _ : state) {
    state.PauseTiming();
    problem = scene(size).problem;
    state.ResumeTiming();
    summary = adjuster.solve(problem, size.options);
  }
  report(state, problem, summary.iterations);
}

void BM_Ceres(benchmark::State& state, const Size& size, CeresSchur schur) {
  BundleProblem problem;
  CeresBundleTimes times;
  for (auto _ : state) {
    state.PauseTiming();
    problem = scene(size).problem;
    state.ResumeTiming();
    times = solve_bundle_with_ceres(kCamera, problem, size.options, schur);
  }
  report(state, problem, times.iterations);
  state.counters["without_building_ms"] = 1e3 * times.total_s;
}

BENCHMARK_CAPTURE(BM_Own, local, kLocal)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Ceres, local_dense, kLocal, CeresSchur::Dense)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Ceres, local_sparse, kLocal, CeresSchur::Sparse)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Own, whole, kWhole)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Ceres, whole_sparse, kWhole, CeresSchur::Sparse)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(BM_Ceres, whole_iterative, kWhole, CeresSchur::Iterative)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace posed
