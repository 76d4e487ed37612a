// How often, how fast and how rightly a lost camera is found again in a map.
//
//   relocalization_trials [TRIALS] [SEEDS]
//
// Worlds: room, office and corridor, SEEDS of each (2 where not said otherwise). Each is mapped in one round and saved; every trial
// starts from that map, as a daemon that is started again, at a random place of the way. Then one of three things happens, in turn:
//
//   covered   20 frames are tracked, the camera is covered for two seconds while it goes on moving, and uncovered
//   teleport  20 frames are tracked, and the camera is suddenly at another place, at least 2 m or 45 degrees away
//   restart   the start itself
//
// In every trial the camera is held beside the mapped way: up to 0.3 m and 15 degrees, at random. It is found when a frame has a
// pose, and right when that is within 0.1 m and 5 degrees of the truth, as the map shows it: relative to the nearest mapped
// keyframe. A pose outside of that is a wrong place. Waiting ends after 90 frames.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/logging.h"
#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_world.h"
#include "tests/support/slam_rig.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

constexpr std::uint64_t kTracked = 20;  // frames before the camera is lost
constexpr std::uint64_t kCovered = 60;
constexpr std::uint64_t kPatience = 90;
constexpr std::uint64_t kInTime = 15;
constexpr double kRight_m = 0.1;
constexpr double kRight_rad = 5 * std::numbers::pi / 180;
constexpr double kElsewhere_m = 2.0;
constexpr double kElsewhere_rad = std::numbers::pi / 4;
constexpr std::array kWorlds{SyntheticWorldKind::Room, SyntheticWorldKind::Office, SyntheticWorldKind::Corridor};

enum Kind : std::size_t { Covered, Teleport, Restart, kKinds };
constexpr std::array<const char*, kKinds> kNames{"covered", "teleport", "restart"};

struct Outcome {
  std::uint64_t frames = 0;  ///< until the first pose, that frame included; 0: none came
  bool right = false;
  std::uint32_t map_id = 0;
};

struct Tally {
  std::vector<std::uint64_t> frames;  ///< of those found rightly
  int trials = 0;
  int wrong = 0;

  void add(const Outcome& outcome) {
    ++trials;
    wrong += outcome.frames > 0 && !outcome.right ? 1 : 0;
    if (outcome.right) {
      frames.push_back(outcome.frames);
    }
  }
  void print(const std::string& name) {
    std::sort(frames.begin(), frames.end());
    const auto in_time = std::upper_bound(frames.begin(), frames.end(), kInTime) - frames.begin();
    fmt::print("{:<22} {:>6} {:>14} {:>13} {:>6} {:>7} {:>7}\n", name, trials, in_time, frames.size(), wrong,
               frames.empty() ? 0 : frames[frames.size() / 2], frames.empty() ? 0 : frames.back());
  }
};

/// One world with its map.
class MappedWorld {
 public:
  MappedWorld(SyntheticWorldKind kind, std::int64_t seed, const TemporaryFolder& folder) : rig_(rig_config(kind, seed)) {
    name_ = fmt::format("{} {}", world_name(kind), seed);
    double worst_m = 0;
    for (std::uint64_t i = 0; i < rig_.frames_a_round(); ++i) {
      const PoseEstimate estimate = rig_.track(i);
      if (!estimate.has_pose()) {
        fmt::print(stderr, "{}: lost at frame {} while mapping\n", name_, i);
        std::exit(EXIT_FAILURE);
      }
      worst_m = std::max(worst_m, rig_.error_m(i, estimate));
    }
    saved_ = rig_.save(folder / name_);
    fmt::print("{}: {} keyframes, {} landmarks, error of the round at most {:.3f} m\n", name_, rig_.mapper().keyframe_count(),
               rig_.mapper().landmark_count(), worst_m);
  }

  const std::string& name() const { return name_; }

  Outcome try_once(Kind kind, HashRng& random) {
    rig_.restart(saved_);
    const auto held = [&] {
      Vector6d xi;
      for (int i = 0; i < 6; ++i) {
        xi[i] = random.uniform(-1.0F, 1.0F);
      }
      xi.head<3>() *= random.uniform() * 15 * std::numbers::pi / 180 / xi.head<3>().norm();
      xi.tail<3>() *= random.uniform() * 0.3 / xi.tail<3>().norm();
      return Se3::exp(xi);
    };
    rig_.hold_beside(held());
    std::uint64_t at = anywhere(random);
    if (kind == Restart) {
      return wait_for_pose(at);
    }
    for (std::uint64_t found = 0, last = at + kTracked + kPatience; found < kTracked && at < last; ++at) {
      found += rig_.track(at).has_pose() ? 1 : 0;
    }
    if (kind == Covered) {
      for (const std::uint64_t until = at + kCovered; at < until; ++at) {
        rig_.track(at, cover_camera);
      }
      return wait_for_pose(at);
    }
    const Se3 left = rig_.true_pose(at);
    do {
      at = anywhere(random);
    } while (distance_between_m(left, rig_.true_pose(at)) < kElsewhere_m &&
             angle_between_rad(left, rig_.true_pose(at)) < kElsewhere_rad);
    return wait_for_pose(at);
  }

 private:
  std::uint64_t anywhere(HashRng& random) { return random.index(static_cast<std::uint32_t>(rig_.frames_a_round())); }

  Outcome wait_for_pose(std::uint64_t begin) {
    for (std::uint64_t i = 0; i < kPatience; ++i) {
      const PoseEstimate estimate = rig_.track(begin + i);
      if (estimate.has_pose()) {
        const Se3 truth = rig_.place_in(saved_, rig_.true_pose(begin + i));
        const bool right = estimate.map_id == 1 && distance_between_m(truth, estimate.T_map_camera()) < kRight_m &&
                           angle_between_rad(truth, estimate.T_map_camera()) < kRight_rad;
        if (!right || i >= kInTime) {
          fmt::print("  {} from frame {}: found after {} frames, {} inliers, map {}, {:.3f} m, {:.1f} deg off\n", name_, begin,
                     i + 1, estimate.inliers, estimate.map_id, distance_between_m(truth, estimate.T_map_camera()),
                     angle_between_rad(truth, estimate.T_map_camera()) * 180 / std::numbers::pi);
        }
        return {i + 1, right, estimate.map_id};
      }
    }
    fmt::print("  {} from frame {}: not found\n", name_, begin);
    return {};
  }

  SlamRig rig_;
  std::string name_;
  SlamRig::SavedMap saved_;
};

int run(int trials, int seeds) {
  const TemporaryFolder folder;
  std::vector<std::unique_ptr<MappedWorld>> worlds;
  for (const SyntheticWorldKind kind : kWorlds) {
    for (int seed = 1; seed <= seeds; ++seed) {
      worlds.push_back(std::make_unique<MappedWorld>(kind, seed, folder));
      std::fflush(stdout);
    }
  }
  HashRng random(1);
  Tally all;
  std::array<Tally, kKinds> by_kind;
  std::map<std::string, Tally> by_world;
  for (int i = 0; i < trials; ++i) {
    const auto kind = static_cast<Kind>(static_cast<std::size_t>(i) % kKinds);
    MappedWorld& world = *worlds[static_cast<std::size_t>(i) / kKinds % worlds.size()];
    const Outcome outcome = world.try_once(kind, random);
    all.add(outcome);
    by_kind[kind].add(outcome);
    by_world[world.name()].add(outcome);
    std::fflush(stdout);
  }
  fmt::print("{:<22} {:>6} {:>14} {:>13} {:>6} {:>7} {:>7}\n", "", "trials", "within 15", "within 90", "wrong", "median", "most");
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    by_kind[kind].print(kNames[kind]);
  }
  for (auto& [name, tally] : by_world) {
    tally.print(name);
  }
  all.print("all");
  return all.wrong == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  return posed::run(argc > 1 ? std::atoi(argv[1]) : 100, argc > 2 ? std::atoi(argv[2]) : 2);
}
