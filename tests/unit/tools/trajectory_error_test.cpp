#include "tools/posectl/trajectory_error.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kFirstStamp_ns = 1'305'031'102'000'000'000;
constexpr std::int64_t kPeriod_ns = 50'000'000;

/// A curve through space that turns about all axes, 20 Hz.
Trajectory make_curve(int poses) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.05 * i;
    Vector6d xi;
    xi << 0.4 * std::sin(t), 0.3 * std::cos(0.7 * t), 0.1 * t, std::cos(t), std::sin(1.3 * t), 0.2 * t;
    trajectory.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3::exp(xi)});
  }
  return trajectory;
}

Se3 random_pose(std::mt19937_64& random, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  return Se3::exp(Vector6d::NullaryExpr([&](Eigen::Index) { return normal(random); }));
}

Trajectory moved(const Trajectory& trajectory, const Se3& T_new_world) {
  Trajectory result = trajectory;
  for (StampedPose& pose : result) {
    pose.T_world_camera = T_new_world * pose.T_world_camera;
  }
  return result;
}

Trajectory disturbed(const Trajectory& trajectory, std::mt19937_64& random, double scale) {
  Trajectory result = trajectory;
  for (StampedPose& pose : result) {
    pose.T_world_camera = pose.T_world_camera * random_pose(random, scale);
  }
  return result;
}

TrajectoryError evaluate(const Trajectory& truth, const Trajectory& estimate, const TrajectoryErrorOptions& options = {}) {
  Result<TrajectoryError> error = evaluate_trajectory(truth, estimate, options);
  EXPECT_TRUE(error) << error.error().message;
  return error.value_or(TrajectoryError{});
}

TEST(ErrorStatistics, MatchHandComputedValues) {
  const ErrorStatistics odd = error_statistics({2, 9, 1});
  EXPECT_DOUBLE_EQ(odd.mean, 4);
  EXPECT_DOUBLE_EQ(odd.median, 2);
  EXPECT_DOUBLE_EQ(odd.max, 9);
  EXPECT_DOUBLE_EQ(odd.rmse, std::sqrt(86.0 / 3));
  EXPECT_DOUBLE_EQ(odd.std, std::sqrt(38.0 / 3));
  EXPECT_DOUBLE_EQ(error_statistics({4, 1, 2, 3}).median, 2.5);
}

TEST(PairByStamp, TakesTheNearestWithinTheLimit) {
  const auto at = [](std::int64_t ms) { return StampedPose{ms * 1'000'000, Se3()}; };
  const Trajectory truth{at(100), at(110), at(200)};
  const std::vector<PosePair> pairs =
      pair_by_stamp(truth, {at(80), at(79), at(104), at(105), at(106), at(180), at(220), at(221)}, 0.02);
  std::vector<std::pair<std::int64_t, std::int64_t>> stamps_ms;
  for (const PosePair& pair : pairs) {
    stamps_ms.emplace_back(pair.estimate.stamp_ns / 1'000'000, pair.truth.stamp_ns / 1'000'000);
  }
  EXPECT_THAT(stamps_ms, testing::ElementsAre(std::pair(80, 100), std::pair(104, 100), std::pair(105, 110), std::pair(106, 110),
                                              std::pair(180, 200), std::pair(220, 200)));
  EXPECT_TRUE(pair_by_stamp({}, truth, 0.02).empty());
}

TEST(EvaluateTrajectory, OfTheTruthItselfIsZero) {
  const Trajectory truth = make_curve(100);
  const TrajectoryError error = evaluate(truth, truth);
  EXPECT_EQ(error.pairs.size(), 100u);
  EXPECT_DOUBLE_EQ(error.coverage, 1.0);
  EXPECT_LT(error.ate_m.max, 1e-12);
  ASSERT_TRUE(error.rpe);
  EXPECT_EQ(error.rpe->intervals, 80u);
  EXPECT_LT(error.rpe->translation_rmse_m, 1e-12);
  EXPECT_LT(error.rpe->rotation_rmse_deg, 1e-6);
}

TEST(EvaluateTrajectory, IgnoresWhereTheMapLies) {
  std::mt19937_64 random(3);
  const Trajectory truth = make_curve(100);
  for (int i = 0; i < 100; ++i) {
    const Se3 T_truth_map = random_pose(random, 2.0);
    const TrajectoryError error = evaluate(truth, moved(truth, T_truth_map.inverse()));
    ASSERT_LT(error.ate_m.max, 1e-10);
    ASSERT_LT((error.T_truth_estimate.inverse() * T_truth_map).log().norm(), 1e-9);
    ASSERT_LT(error.rpe->translation_rmse_m, 1e-10);
  }
}

TEST(EvaluateTrajectory, AlignsBetterThanAnyOtherTransform) {
  std::mt19937_64 random(4);
  const Trajectory truth = make_curve(60);
  for (int i = 0; i < 20; ++i) {
    const Trajectory estimate = moved(disturbed(truth, random, 0.05), random_pose(random, 1.0));
    const std::vector<PosePair> pairs = pair_by_stamp(truth, estimate, 0.02);
    const Se3 best = align_positions(pairs);
    const auto cost = [&](const Se3& T_truth_estimate) {
      double sum = 0;
      for (const PosePair& pair : pairs) {
        sum +=
            (T_truth_estimate * pair.estimate.T_world_camera.translation() - pair.truth.T_world_camera.translation()).squaredNorm();
      }
      return sum;
    };
    for (int k = 0; k < 20; ++k) {
      ASSERT_LT(cost(best), cost(best * random_pose(random, 1e-3)));
    }
  }
}

TEST(EvaluateTrajectory, NeverMirrors) {
  // Points on the axes, 3, 2 and 1 m out, and their mirror image: a reflection would bring them together. The best rotation gives
  // up the direction of least spread, whose variance is 1/3 m^2, and leaves twice its deviation there.
  Trajectory truth;
  Trajectory mirrored;
  for (int i = 0; i < 12; ++i) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    p[i % 3] = (3 - i % 3) * (i < 6 ? 1.0 : -1.0);
    truth.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, p)});
    mirrored.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, {-p.x(), p.y(), p.z()})});
  }
  EXPECT_NEAR(evaluate(truth, mirrored).ate_m.rmse, 2.0 / std::sqrt(3.0), 1e-12);
}

TEST(EvaluateTrajectory, DoesNotScale) {
  // Two groups of points 2 m apart in truth and 1 m in the estimate: each is 0.5 m off after alignment.
  Trajectory truth;
  Trajectory estimate;
  for (int i = 0; i < 10; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    truth.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, {side, 0, 0})});
    estimate.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, {0.5 * side, 0, 0})});
  }
  const TrajectoryError error = evaluate(truth, estimate);
  EXPECT_NEAR(error.ate_m.rmse, 0.5, 1e-12);
  EXPECT_NEAR(error.ate_m.std, 0.0, 1e-12);
  EXPECT_FALSE(error.rpe);
}

TEST(EvaluateTrajectory, MeasuresADriftOfKnownSpeed) {
  // Straight on at 1 m/s in truth, 1.1 m/s in the estimate, which also turns by 2 degrees a second.
  Trajectory truth;
  Trajectory estimate;
  for (int i = 0; i < 41; ++i) {
    const double t = 0.05 * i;
    truth.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, {t, 0, 0})});
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.0 * std::numbers::pi / 180.0 * t, Eigen::Vector3d::UnitX()));
    estimate.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3(turn, {1.1 * t, 0, 0})});
  }
  const TrajectoryError error = evaluate(truth, estimate);
  // Centred at t = 1 s, the error is 0.1 |t - 1|: its largest value is 0.1, its mean 0.1 * 0.05 * 2 * (1 + ... + 20) / 41.
  EXPECT_NEAR(error.ate_m.max, 0.1, 1e-12);
  EXPECT_NEAR(error.ate_m.mean, 0.1 * 0.05 * 2 * 210 / 41, 1e-12);
  ASSERT_TRUE(error.rpe);
  EXPECT_NEAR(error.rpe->translation_rmse_m, 0.1, 1e-9);
  EXPECT_NEAR(error.rpe->rotation_rmse_deg, 2.0, 1e-9);
}

TEST(EvaluateTrajectory, CoverageIsTheShareOfFrames) {
  const Trajectory truth = make_curve(100);
  Trajectory estimate(truth.begin() + 20, truth.end());
  EXPECT_DOUBLE_EQ(evaluate(truth, estimate).coverage, 1.0);
  EXPECT_DOUBLE_EQ(evaluate(truth, estimate, {.frames = 100}).coverage, 0.8);
}

TEST(EvaluateTrajectory, RefusesTooFewPairs) {
  const Trajectory truth = make_curve(100);
  const Result<TrajectoryError> error = evaluate_trajectory(truth, Trajectory(truth.begin(), truth.begin() + 9), {});
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(error.error().message, HasSubstr("only 9 of 9 estimated poses"));
}

TEST(EvaluateTrajectory, SurvivesACameraThatStoodStill) {
  Trajectory still;
  for (int i = 0; i < 30; ++i) {
    still.push_back({kFirstStamp_ns + i * kPeriod_ns, Se3({1, 0, 0, 0}, {1, 2, 3})});
  }
  const TrajectoryError error = evaluate(still, still);
  EXPECT_LT(error.ate_m.max, 1e-12);
}

TEST(TrajectoryErrorJson, IsNullWhereThereIsNoRelativeError) {
  TrajectoryErrorOptions options;
  options.rpe_interval_s = 1000;
  const Trajectory truth = make_curve(20);
  const nlohmann::json json = nlohmann::json::parse(to_json(evaluate(truth, truth, options)));
  EXPECT_EQ(json.at("poses"), 20);
  EXPECT_TRUE(json.at("rpe_trans_1s").is_null());
}

/// The referee is a script of its own, outside of the project.
class Referee : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("POSED_TEST_DATA");
    data_ = data != nullptr ? std::filesystem::path(data) : std::filesystem::path(POSED_SOURCE_DIR) / "../shared/data";
    script_ = data_ / "../tools/evaluate_trajectory.py";
    if (!std::filesystem::exists(script_)) {
      GTEST_SKIP() << "there is no " << script_;
    }
    for (const char* python : {"python3", "/usr/bin/python3"}) {
      if (std::system((std::string(python) + " -c 'import numpy' 2>/dev/null").c_str()) == 0) {
        python_ = python;
        return;
      }
    }
    GTEST_SKIP() << "python3-numpy is not installed";
  }

  nlohmann::json judge(const std::string& truth, const std::string& estimate, const std::string& frames) const {
    const std::string command =
        python_ + " '" + script_.string() + "' '" + truth + "' '" + estimate + "' --frames '" + frames + "'";
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::string output;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) {
      output += static_cast<char>(c);
    }
    EXPECT_EQ(::pclose(pipe), 0) << command;
    return nlohmann::json::parse(output, nullptr, false);
  }

  std::filesystem::path data_;
  std::filesystem::path script_;
  std::string python_;
};

TEST_F(Referee, AgreesOnTheRecordingWithNoiseAndGaps) {
  const std::filesystem::path sequence = data_ / "tum_fr1_xyz";
  if (!std::filesystem::exists(sequence / "groundtruth.txt")) {
    GTEST_SKIP() << "there is no " << sequence;
  }
  const std::string truth_path = (sequence / "groundtruth.txt").string();
  const std::string frames_path = (sequence / "rgb.txt").string();
  const Result<Trajectory> truth = read_trajectory(truth_path);
  const Result<std::vector<std::int64_t>> frames = read_frame_stamps(frames_path);
  ASSERT_TRUE(truth && frames);
  std::mt19937_64 random(5);
  const Se3 T_map_world = random_pose(random, 1.0);
  Trajectory estimate;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    if (i % 50 < 5) {
      continue;  // lost
    }
    const std::vector<PosePair> nearest = pair_by_stamp(*truth, {{(*frames)[i], Se3()}}, 0.02);
    if (!nearest.empty()) {
      estimate.push_back({(*frames)[i], T_map_world * nearest.front().truth.T_world_camera * random_pose(random, 0.01)});
    }
  }
  const TemporaryFolder folder;
  const std::string estimate_path = folder.write("estimate.txt", format_trajectory(estimate));
  const nlohmann::json verdict = judge(truth_path, estimate_path, frames_path);
  ASSERT_FALSE(verdict.is_discarded());
  const nlohmann::json ours =
      nlohmann::json::parse(to_json(evaluate(*truth, *read_trajectory(estimate_path), {.frames = frames->size()})));
  EXPECT_EQ(ours.at("poses"), verdict.at("poses"));
  for (const char* key :
       {"coverage", "ate_rmse", "ate_mean", "ate_median", "ate_std", "ate_max", "rpe_trans_1s", "rpe_rot_1s_deg"}) {
    // The referee rounds to four or five decimals.
    EXPECT_NEAR(ours.at(key).get<double>(), verdict.at(key).get<double>(), 5.1e-5) << key;
  }
}

}  // namespace
}  // namespace posed
