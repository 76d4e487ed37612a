// Whether loops are closed where the camera comes round again, what that corrects, and that rooms which look alike are kept apart.
//
//   loop_trials WORLD [SEED] [FEATURES] [LOCAL_KEYFRAMES] [ROUNDS]
//
// WORLD: corridor, office, twin_rooms or room. Runs tracker and mapper in lockstep over ROUNDS (2) rounds of the way, and prints a
// line for every closure and the table's row for the run. FEATURES and LOCAL_KEYFRAMES (the defaults of the configuration where not
// said, or 0) make odometry drift: few features measure less well, and with a small local map the tracker does not find old
// landmarks by itself, so that only an explicit closure brings it back.
//
// The columns, in metres: what odometry has drifted by at the end of the first round (T_odom_camera against the truth); error of
// T_map_camera before and after the closure that corrected most, and by how much it moved the camera; closures; false ones (after
// which the error is larger by more than 0.1 m); matches refused as implausible; the share of the frames after the first round
// whose pose relative to the same frame one round earlier is right to 0.05 m in the final trajectory; absolute trajectory error
// (root mean square after alignment) of the poses as they were published, and of the final ones; maps begun, more than one where
// the camera was lost for long (errors then count from the last map's first frame); frames without a pose.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/rigid_alignment.h"
#include "drivers/synthetic_world.h"
#include "tests/support/slam_rig.h"

namespace posed {
namespace {

constexpr double kFalse_m = 0.1;
constexpr double kRejoined_m = 0.05;

struct Closure {
  std::uint64_t frame = 0;
  double before_m = 0;
  double after_m = 0;
  double correction_m = 0;
  double odom_step_error_m = 0;  ///< how far the step in odom over the closure is from the true motion
};

double ate_m(const std::vector<std::pair<Se3, Se3>>& estimate_and_truth) {
  std::vector<Eigen::Vector3d> estimates;
  std::vector<Eigen::Vector3d> truths;
  for (const auto& [estimate, truth] : estimate_and_truth) {
    estimates.push_back(estimate.translation());
    truths.push_back(truth.translation());
  }
  const Se3 T_truth_estimate = align_points(truths, estimates);
  double squared = 0;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    squared += (truths[i] - T_truth_estimate * estimates[i]).squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(truths.size()));
}

class Trial {
 public:
  Trial(const Config& config, std::uint64_t rounds) : rig_(config), frames_(rounds * rig_.frames_a_round()) {}

  void run() {
    std::uint64_t closed = 0;
    for (std::uint64_t i = 0; i < frames_; ++i) {
      estimates_.push_back(rig_.track(i));
      if (const PoseEstimate& e = estimates_.back(); e.has_pose() && e.map_id > maps_) {
        maps_ = e.map_id;
        T_map_world_ = e.T_map_camera() * rig_.true_pose(i).inverse();
      }
      if (i + 1 == rig_.frames_a_round()) {
        odom_drift_m_ = distance_between_m(estimates_.back().T_odom_camera, T_map_world_ * rig_.true_pose(i));
      }
      if (std::exchange(awaited_, false)) {
        finish_closure(i);
      }
      if (rig_.mapper().counters().loops_closed > closed) {
        closed = rig_.mapper().counters().loops_closed;
        awaited_ = true;  // the next frame is the first to be tracked in the corrected map
      }
    }
  }

  void print(const std::string& name) const {
    const auto most = std::max_element(closures_.begin(), closures_.end(),
                                       [](const Closure& a, const Closure& b) { return a.correction_m < b.correction_m; });
    const auto wrong =
        std::count_if(closures_.begin(), closures_.end(), [](const Closure& c) { return c.after_m > c.before_m + kFalse_m; });
    const Closure shown = most == closures_.end() ? Closure{} : *most;
    fmt::print("{:<28} {:>6} {:>7} {:>6} {:>7} {:>6} {:>6} {:>8} {:>9} {:>7} {:>7} {:>4} {:>5}\n", "run", "odom", "before", "after",
               "correct", "closed", "false", "refused", "rejoined", "ATE on", "ATE fin", "maps", "lost");
    fmt::print("{:<28} {:>6.3f} {:>7.3f} {:>6.3f} {:>7.3f} {:>6} {:>6} {:>8} {:>8.1f}% {:>7.3f} {:>7.3f} {:>4} {:>5}\n", name,
               odom_drift_m_, shown.before_m, shown.after_m, shown.correction_m, closures_.size(), wrong,
               rig_.mapper().counters().loops_implausible, 100 * rejoined(), ate_m(trajectory(false)), ate_m(trajectory(true)),
               maps_, std::count_if(estimates_.begin(), estimates_.end(), [](const PoseEstimate& e) { return !e.has_pose(); }));
  }

 private:
  void finish_closure(std::uint64_t i) {
    const PoseEstimate& before = estimates_[i - 1];
    const PoseEstimate& after = estimates_[i];
    if (!before.has_pose() || !after.has_pose()) {
      return;
    }
    const Se3 step = before.T_odom_camera.inverse() * after.T_odom_camera;
    const Se3 true_step = rig_.true_pose(i - 1).inverse() * rig_.true_pose(i);
    closures_.push_back({i, error_m(i - 1), error_m(i),
                         distance_between_m(before.T_map_odom * after.T_odom_camera, after.T_map_camera()),
                         distance_between_m(step, true_step)});
    const Closure& c = closures_.back();
    fmt::print("frame {}: error {:.3f} -> {:.3f} m, corrected by {:.3f} m, step in odom {:.4f} m from the true one\n", c.frame,
               c.before_m, c.after_m, c.correction_m, c.odom_step_error_m);
    std::fflush(stdout);
  }

  double error_m(std::uint64_t i) const {
    return distance_between_m(estimates_[i].T_map_camera(), T_map_world_ * rig_.true_pose(i));
  }

  double rejoined() const {
    int right = 0;
    const std::uint64_t round = rig_.frames_a_round();
    for (std::uint64_t i = round; i < frames_; ++i) {
      const auto now = rig_.final_pose(estimates_[i]);
      const auto then = rig_.final_pose(estimates_[i - round]);
      const Se3 truth = rig_.true_pose(i - round).inverse() * rig_.true_pose(i);
      right += now && then && distance_between_m(then->inverse() * *now, truth) < kRejoined_m ? 1 : 0;
    }
    return static_cast<double>(right) / static_cast<double>(frames_ - round);
  }

  std::vector<std::pair<Se3, Se3>> trajectory(bool final) const {
    std::vector<std::pair<Se3, Se3>> poses;
    for (std::uint64_t i = 0; i < frames_; ++i) {
      if (estimates_[i].has_pose()) {
        const std::optional<Se3> pose = final ? rig_.final_pose(estimates_[i]) : estimates_[i].T_map_camera();
        if (pose) {
          poses.emplace_back(*pose, rig_.true_pose(i));
        }
      }
    }
    return poses;
  }

  SlamRig rig_;
  std::uint64_t frames_;
  std::vector<PoseEstimate> estimates_;
  std::vector<Closure> closures_;
  bool awaited_ = false;
  std::uint32_t maps_ = 0;
  Se3 T_map_world_;
  double odom_drift_m_ = 0;
};

std::optional<SyntheticWorldKind> world_of(std::string_view name) {
  for (const SyntheticWorldKind kind :
       {SyntheticWorldKind::Room, SyntheticWorldKind::Corridor, SyntheticWorldKind::Office, SyntheticWorldKind::TwinRooms}) {
    if (world_name(kind) == name) {
      return kind;
    }
  }
  return std::nullopt;
}

int run(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i && std::atoi(argv[i]) > 0 ? std::atoi(argv[i]) : otherwise; };
  const auto world = argc > 1 ? world_of(argv[1]) : std::nullopt;
  if (!world) {
    fmt::print(stderr,
               "loop_trials WORLD [SEED] [FEATURES] [LOCAL_KEYFRAMES] [ROUNDS]; WORLD: corridor, office, room, twin_rooms\n");
    return EXIT_FAILURE;
  }
  Config config = rig_config(*world, number(2, 1));
  config.tracker.features = number(3, config.tracker.features);
  config.mapper.local_keyframes = number(4, config.mapper.local_keyframes);
  const int rounds = number(5, 2);
  Trial trial(config, static_cast<std::uint64_t>(rounds));
  trial.run();
  trial.print(fmt::format("{} {}, {} f, {} kf, {} r", argv[1], config.source.synthetic.seed, config.tracker.features,
                          config.mapper.local_keyframes, rounds));
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  return posed::run(argc, argv);
}
