// Whether the covariance of the pose is honest: the normalised estimation error squared over synthetic worlds.
//
//   consistency_bench FIRST_SEED LAST_SEED [DURATION_S [DRIFT_FACTOR]]
//
// Tracker and mapper take turns over room, office and corridor without people, 320x240 at 30 Hz, DURATION_S (40) of each world and
// seed. The map's frame is fixed by the first frame, so the truth is known in it and nothing is aligned. Printed for each run and
// for all: the share of frames with the error squared, weighted by the inverse covariance, within the two-sided 95 % band of
// chi-squared, the share below the one-sided 95 % bound, and its mean, for the whole pose (6 degrees of freedom), its rotation and
// its translation (3 each); and the root mean square of error over stated sigma for each axis.
//
// DRIFT_FACTOR is mapper.drift_factor.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Cholesky>

#include "config/config_loader.h"
#include "core/frame_pool.h"
#include "drivers/synthetic_camera.h"
#include "slam/mapper.h"
#include "slam/tracker.h"

namespace posed {
namespace {

/// Share of frames within the band and below the bound, and the mean, of one normalised error squared.
struct Consistency {
  int dimensions;
  double band_low;
  double band_high;
  double bound;
  int frames = 0;
  int in_band = 0;
  int below_bound = 0;
  double sum = 0;

  void count(double nees) {
    ++frames;
    in_band += nees >= band_low && nees <= band_high ? 1 : 0;
    below_bound += nees <= bound ? 1 : 0;
    sum += nees;
  }
  void print(const char* name) const {
    std::printf("  %-11s in band %.3f  below bound %.3f  mean %6.2f of %d\n", name, static_cast<double>(in_band) / frames,
                static_cast<double>(below_bound) / frames, sum / frames, dimensions);
  }
};

struct Statistics {
  // Quantiles 0.025, 0.975 and 0.95 of chi-squared.
  Consistency pose{6, 1.237, 14.449, 12.592};
  Consistency rotation{3, 0.216, 9.348, 7.815};
  Consistency translation{3, 0.216, 9.348, 7.815};
  Vector6d squared_ratio = Vector6d::Zero();
  double worst_m = 0;
  int without_pose = 0;

  void count(const Vector6d& xi, const Matrix6d& covariance) {
    const auto nees = [](const auto& error, const auto& c) { return error.dot(c.ldlt().solve(error)); };
    pose.count(nees(xi, covariance));
    const Eigen::Matrix3d of_rotation = covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d of_translation = covariance.bottomRightCorner<3, 3>();
    rotation.count(nees(Eigen::Vector3d(xi.head<3>()), of_rotation));
    translation.count(nees(Eigen::Vector3d(xi.tail<3>()), of_translation));
    squared_ratio.array() += xi.array().square() / covariance.diagonal().array();
    worst_m = std::max(worst_m, xi.tail<3>().norm());
  }
  void print(const std::string& name) const {
    const Vector6d ratio = (squared_ratio / std::max(1, pose.frames)).cwiseSqrt();
    std::printf("%s: %d frames, %d without a pose, largest error %.3f m\n", name.c_str(), pose.frames, without_pose, worst_m);
    pose.print("pose");
    rotation.print("rotation");
    translation.print("translation");
    std::printf("  error / sigma  phi %.2f %.2f %.2f  rho %.2f %.2f %.2f\n", ratio[0], ratio[1], ratio[2], ratio[3], ratio[4],
                ratio[5]);
    std::fflush(stdout);
  }
};

class Run {
 public:
  Run(const Config& config, SyntheticWorldKind world, std::int64_t seed, double duration_s)
      : pool_(config.intrinsics.width, config.intrinsics.height, 1),
        tracker_(config.tracker, config.mapper, config.dynamic, MapMode::Mapping, config.intrinsics, Se3()),
        mapper_(config.tracker, config.mapper, MapMode::Mapping, config.intrinsics) {
    SyntheticConfig synthetic;
    synthetic.world = world;
    synthetic.people = 0;
    synthetic.seed = seed;
    synthetic.duration_s = duration_s;
    camera_ = std::move(SyntheticCamera::create(synthetic, config.intrinsics).value());
    name_ = std::string(world_name(world)) + " " + std::to_string(seed);
  }

  void go(Statistics& all) {
    Statistics statistics;
    for (std::uint64_t i = 0; i < camera_->total_frames(); ++i) {
      FrameWriter frame = *pool_.acquire();
      if (!camera_->render(i, *frame)) {
        std::abort();
      }
      const PoseEstimate estimate = tracker_.track(*frame, snapshot_, nullptr, &record_);
      if (estimate.has_pose() && estimate.map_id == 1 && i > 0) {
        const Vector6d xi = (estimate.T_map_camera().inverse() * truth(i)).log();
        statistics.count(xi, estimate.covariance);
        all.count(xi, estimate.covariance);
      } else if (i > 0) {
        ++statistics.without_pose;
        ++all.without_pose;
      }
      if (estimate.keyframe || estimate.asks_where) {
        map();
      }
    }
    statistics.print(name_ + " (" + std::to_string(mapper_.counters().loops_closed) + " loops)");
  }

 private:
  Se3 truth(std::uint64_t index) const { return camera_->pose(0).inverse() * camera_->pose(index); }

  void map() {
    mapper_.insert(record_);
    while (mapper_.improve({})) {
    }
    mapper_.write_snapshot(snapshot_);
  }

  std::string name_;
  std::unique_ptr<SyntheticCamera> camera_;
  FramePool pool_;
  Tracker tracker_;
  Mapper mapper_;
  MapSnapshot snapshot_;
  KeyframeRecord record_;
};

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  using namespace posed;
  if (argc < 3) {
    std::fputs("usage: consistency_bench FIRST_SEED LAST_SEED [DURATION_S [DRIFT_FACTOR]]\n", stderr);
    return EXIT_FAILURE;
  }
  const double duration_s = argc > 3 ? std::atof(argv[3]) : 40.0;
  Config config = default_config().value();
  config.mapper.drift_factor = argc > 4 ? std::atof(argv[4]) : config.mapper.drift_factor;
  Statistics all;
  for (std::int64_t seed = std::atol(argv[1]); seed <= std::atol(argv[2]); ++seed) {
    for (const SyntheticWorldKind world : {SyntheticWorldKind::Room, SyntheticWorldKind::Office, SyntheticWorldKind::Corridor}) {
      Run(config, world, seed, duration_s).go(all);
    }
  }
  all.print("all");
  return EXIT_SUCCESS;
}
