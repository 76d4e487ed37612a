// Faults of a camera, put into the rendered world, through the whole pipeline: what is published during and after them. The table
// in docs/reliability.md is what this prints.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "daemon/app.h"

namespace posed {
namespace {

constexpr std::uint64_t kFrames = 300;
constexpr std::uint64_t kFrozenBeforeItIsSeen = 2;  // FrameGuard::kRepeatsAllowed

struct CameraFault {
  std::string name;
  std::vector<std::string> faults;
  std::uint64_t first;        ///< frame that is hit
  std::uint64_t last;         ///< the last one
  bool poses_during;          ///< the frames that are hit can still be tracked, so most of them are
  std::uint64_t max_skipped;  ///< frames that the guard keeps out
};

void PrintTo(const CameraFault& fault, std::ostream* out) {
  *out << fault.name;
}

/// What one run published.
struct Published {
  std::vector<PoseEstimate> estimates;
  std::map<std::uint64_t, Se3> truth;  // by frame
  HealthReport health;
};

Published run(const std::vector<std::string>& faults) {
  Config config = default_config().value();
  config.source.pacing = Pacing::Lockstep;
  config.source.synthetic.people = 0;
  config.source.synthetic.seed = 5;
  config.source.synthetic.duration_s = static_cast<double>(kFrames) / config.source.synthetic.rate_hz;
  config.source.faults = faults;
  config.detector.enabled = false;
  Published published;
  AppOptions options;
  options.publish = false;
  options.on_tracked = [&](const TrackedView& view) {
    published.estimates.push_back(view.estimate);
    published.truth.emplace(view.frame.sequence, view.frame.T_world_camera_truth.value());
  };
  const Result<std::unique_ptr<App>> app = App::create(config, std::move(options), SystemClock::instance());
  if (!app) {
    ADD_FAILURE() << app.error().message;
    return published;
  }
  EXPECT_TRUE((*app)->start());
  EXPECT_TRUE((*app)->wait_finished(100 * kNsPerSecond));
  (*app)->stop();
  published.health = (*app)->health();
  return published;
}

/// Largest error of a published pose against the truth, each map's first pose being its origin [m].
double largest_error_m(const Published& published) {
  std::map<std::uint32_t, Se3> T_world_map;
  double largest = 0;
  for (const PoseEstimate& estimate : published.estimates) {
    if (!estimate.has_pose()) {
      continue;
    }
    const Se3& T_world_camera = published.truth.at(estimate.sequence);
    const auto map = T_world_map.try_emplace(estimate.map_id, T_world_camera * estimate.T_map_camera().inverse()).first;
    largest = std::max(largest, ((map->second * estimate.T_map_camera()).translation() - T_world_camera.translation()).norm());
  }
  return largest;
}

class CameraFaults : public ::testing::TestWithParam<CameraFault> {};

TEST_P(CameraFaults, NoWrongPoseIsPublishedAndTrackingComesBack) {
  const CameraFault& fault = GetParam();
  const Published published = run(fault.faults);
  ASSERT_FALSE(published.estimates.empty());

  std::uint64_t lost = 0;
  std::uint64_t tracked_during = 0;
  std::uint64_t during = 0;
  std::uint64_t back = fault.last + 1;  // the first frame from which on all are tracked
  for (const PoseEstimate& estimate : published.estimates) {
    const bool hit = estimate.sequence >= fault.first && estimate.sequence <= fault.last;
    during += hit ? 1 : 0;
    tracked_during += hit && estimate.has_pose() ? 1 : 0;
    lost += estimate.has_pose() ? 0 : 1;
    if (estimate.sequence > fault.last && !estimate.has_pose()) {
      back = estimate.sequence + 1;
    }
  }
  const double error_m = largest_error_m(published);
  std::printf("| %s | %llu of %llu | %llu | %llu | %.3f m |\n", fault.name.c_str(), static_cast<unsigned long long>(tracked_during),
              static_cast<unsigned long long>(during), static_cast<unsigned long long>(published.health.frames_skipped),
              static_cast<unsigned long long>(back - fault.last - 1), error_m);

  EXPECT_LT(error_m, 0.1) << "a wrong pose was published";
  const auto not_later = [](const PoseEstimate& a, const PoseEstimate& b) {
    return b.capture_ns <= a.capture_ns || b.stamp_utc_ns <= a.stamp_utc_ns;
  };
  EXPECT_EQ(std::adjacent_find(published.estimates.begin(), published.estimates.end(), not_later), published.estimates.end())
      << "stamps do not increase";
  EXPECT_LE(back, fault.last + 31) << "tracking is not back a second after the fault";
  EXPECT_LE(published.health.frames_skipped, fault.max_skipped);
  EXPECT_EQ(published.health.frames_skipped > 0, fault.max_skipped > 0);
  if (fault.poses_during) {
    EXPECT_GE(tracked_during * 10, during * 9);
  }
  EXPECT_EQ(published.estimates.back().sequence, kFrames - 1);
}

INSTANTIATE_TEST_SUITE_P(
    , CameraFaults,
    ::testing::Values(CameraFault{"three frames lost", {"drop 100-102"}, 100, 102, false, 0},
                      CameraFault{"a gap of 2 s", {"drop 100-159"}, 100, 159, false, 0},
                      CameraFault{"10 frames a second", {"thin 100-250 3"}, 100, 250, true, 0},
                      CameraFault{"frames come twice", {"duplicate 100-130"}, 100, 130, true, 31},
                      CameraFault{"image frozen for 1.5 s", {"freeze 100-144"}, 100, 144, false, 45 - kFrozenBeforeItIsSeen},
                      CameraFault{"black for 1 s", {"black 100-129"}, 100, 129, false, 0},
                      CameraFault{"overexposed for 1 s", {"white 100-129"}, 100, 129, false, 0},
                      CameraFault{"no depth for 1 s", {"zero_depth 100-129"}, 100, 129, false, 0},
                      CameraFault{"depth not a number for 1 s", {"nan_depth 100-129"}, 100, 129, false, 0},
                      CameraFault{"half frames for 1 s", {"half 100-129"}, 100, 129, false, 0},
                      CameraFault{"one stamp 0.5 s back", {"stamp 100-100 -0.5"}, 100, 100, false, 1},
                      CameraFault{"stamps 10 s back for 1 s", {"stamp 100-129 -10"}, 100, 129, false, 30},
                      CameraFault{"stamps 1 h ahead for 1 s", {"stamp 100-129 3600"}, 100, 129, false, 30}),
    [](const ::testing::TestParamInfo<CameraFault>& fault) { return std::to_string(fault.index); });

}  // namespace
}  // namespace posed
