#include "tools/posectl/posectl.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <nlohmann/json.hpp>
#include <posed/pose_t.hpp>

#include "core/clock.h"
#include "daemon/message_conversion.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/posectl_outcome.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/trajectory.h"

namespace posed {
namespace {

using testing::HasSubstr;

Trajectory curve(int poses, double scale) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.05 * i;
    trajectory.push_back({1'700'000'000'000'000'000 + i * std::int64_t{50'000'000},
                          Se3({1, 0, 0, 0}, {scale * std::cos(t), scale * std::sin(t), 0.1 * t})});
  }
  return trajectory;
}

TEST(Posectl, HelpNamesSubcommandsAndExitCodes) {
  const Outcome outcome = posectl({"--help"});
  EXPECT_EQ(outcome.exit_code, kExitOk);
  for (const char* text : {"replay", "eval", "watch", "synth", "record", "devices", "calibrate", "model", "check-config", "version",
                           "Exit codes", "78"}) {
    EXPECT_THAT(outcome.out, HasSubstr(text));
  }
}

TEST(Posectl, EverySubcommandHasHelp) {
  for (const char* command : {"replay", "eval", "watch", "synth", "record", "devices", "model", "check-config", "version"}) {
    EXPECT_EQ(posectl({command, "--help"}).exit_code, kExitOk) << command;
  }
}

TEST(Posectl, AWrongCommandLineIsAUsageError) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {},
           {"fly"},
           {"eval"},
           {"eval", "one.txt"},
           {"eval", "a", "b", "--limit", "soon"},
           {"replay"},
           {"replay", "--sequence", "x", "--synthetic"},
           {"replay", "--synthetic", "--lockstep", "--realtime"},
           {"replay", "--sequence", "/tmp", "--trajectory", "/tmp/x"},
           {"replay", "--synthetic", "--mode", "flying"},
           {"replay", "--synthetic", "--duration", "-1"},
           {"replay", "--synthetic", "--localization-only"},
           {"replay", "--synthetic", "--map-in", "a", "--map-out", "b", "--localization-only"},
           {"record"},
           {"record", "x", "--duration", "-1"},
           {"record", "x", "--jpeg-quality", "50"},
           {"record", "x", "--min-free", "much"},
           {"devices", "--config", "--json"},
           {"synth"},
           {"synth", "--out", "x", "--frames", "3", "--duration", "3"},
           {"synth", "--out", "x", "--size", "big"},
           {"watch", "--count", "few"},
           {"check-config"},
       }) {
    const Outcome outcome = posectl(arguments);
    EXPECT_EQ(outcome.exit_code, kExitUsage) << testing::PrintToString(arguments) << outcome.err;
    EXPECT_NE(outcome.err, "") << testing::PrintToString(arguments);
  }
}

TEST(Posectl, VersionPrintsOne) {
  const Outcome outcome = posectl({"version"});
  EXPECT_EQ(outcome.exit_code, kExitOk);
  EXPECT_THAT(outcome.out, testing::MatchesRegex("posectl [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(PosectlEval, WritesTableJsonAndPlot) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", format_trajectory(curve(60, 1.0)));
  const Outcome outcome = posectl({"eval", truth, truth, "--json", folder / "error.json", "--plot", folder / "plot.svg"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("60 paired, coverage 100.0 %"));
  EXPECT_THAT(outcome.out, HasSubstr("rmse 0.00000"));
  EXPECT_NEAR(nlohmann::json::parse(contents_of(folder / "error.json")).at("ate_rmse").get<double>(), 0.0, 1e-8);
  EXPECT_THAT(contents_of(folder / "plot.svg"), HasSubstr("</svg>"));
}

TEST(PosectlEval, DistinguishesMissingMalformedAndTooShort) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", format_trajectory(curve(60, 1.0)));
  const std::string brief = folder.write("brief.txt", format_trajectory(curve(5, 1.0)));
  const std::string broken = folder.write("broken.txt", "1 2 3\n");
  EXPECT_EQ(posectl({"eval", truth, folder / "none.txt"}).exit_code, kExitNoInput);
  EXPECT_EQ(posectl({"eval", truth, truth, "--frames", folder / "none.txt"}).exit_code, kExitNoInput);
  EXPECT_EQ(posectl({"eval", broken, truth}).exit_code, kExitBadData);
  EXPECT_EQ(posectl({"eval", truth, brief}).exit_code, kExitNegative);
  EXPECT_EQ(posectl({"eval", truth, truth, "--json", folder / "none/error.json"}).exit_code, kExitIo);
  EXPECT_EQ(posectl({"eval", truth, truth, "--json", "/dev/full"}).exit_code, kExitIo);
}

TEST(PosectlCheckConfig, AcceptsAndRefuses) {
  const TemporaryFolder folder;
  EXPECT_EQ(posectl({"check-config", std::string(POSED_SOURCE_DIR) + "/config/posed.toml"}).exit_code, kExitOk);
  EXPECT_EQ(posectl({"check-config", folder / "none.toml"}).exit_code, kExitNoInput);
  const Outcome wrong = posectl({"check-config", folder.write("wrong.toml", "[tracker]\nfaetures = 3\n")});
  EXPECT_EQ(wrong.exit_code, kExitConfig);
  EXPECT_THAT(wrong.err, HasSubstr("faetures"));
}

TEST(PosectlReplay, FailsBeforeItRunsWhereInputsOrOutputsAreMissing) {
  const TemporaryFolder folder;
  EXPECT_EQ(posectl({"replay", "--sequence", folder / "none", "--camera", "synthetic.toml"}).exit_code, kExitNoInput);
  EXPECT_EQ(posectl({"replay", "--synthetic", "--config", folder / "none.toml"}).exit_code, kExitNoInput);
  EXPECT_EQ(posectl({"replay", "--synthetic", "--config", folder.write("wrong.toml", "x = 1\n")}).exit_code, kExitConfig);
  const Outcome outcome = posectl({"replay", "--synthetic", "--stats", folder / "none/stats.json"});
  EXPECT_EQ(outcome.exit_code, kExitIo);
  EXPECT_THAT(outcome.err, HasSubstr("mkdir -p"));
}

TEST(PosectlReplay, RefusesASourceWithoutEnd) {
  const TemporaryFolder folder;
  const std::string config = folder.write("endless.toml", "[source]\nkind = \"synthetic\"\n[source.synthetic]\nduration_s = 0.0\n");
  const Outcome outcome = posectl({"replay", "--config", config});
  EXPECT_EQ(outcome.exit_code, kExitUsage);
  EXPECT_THAT(outcome.err, HasSubstr("give --duration"));
}

TEST(PosectlReplay, TracksTheSyntheticWorldTwiceAlike) {
  const TemporaryFolder folder;
  for (const char* run : {"a", "b"}) {
    const std::string name(run);
    const Outcome outcome =
        posectl({"replay", "--synthetic", "--lockstep", "--duration", "1", "--people", "0", "--trajectory",
                 folder / (name + ".txt"), "--online-trajectory", folder / (name + "_online.txt"), "--groundtruth",
                 folder / (name + "_truth.txt"), "--stats", folder / (name + ".json"), "--quiet"});
    ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    EXPECT_EQ(outcome.err, "");
  }
  EXPECT_EQ(contents_of(folder / "a.txt"), contents_of(folder / "b.txt"));
  EXPECT_EQ(contents_of(folder / "a_online.txt"), contents_of(folder / "b_online.txt"));
  const nlohmann::json stats = nlohmann::json::parse(contents_of(folder / "a.json"));
  EXPECT_EQ(stats.at("frames"), 30);
  EXPECT_EQ(stats.at("dropped"), 0);
  EXPECT_EQ(stats.at("frames").get<int>(), stats.at("tracked").get<int>() + stats.at("lost").get<int>());
  EXPECT_EQ(stats.at("track_ms").at("count"), 30);
  EXPECT_EQ(read_trajectory(folder / "a_truth.txt")->size(), 30u);
  EXPECT_EQ(read_trajectory(folder / "a.txt")->size(), stats.at("tracked").get<std::size_t>());
  EXPECT_EQ(posectl({"eval", folder / "a_truth.txt", folder / "a.txt"}).exit_code, kExitOk);
}

TEST(PosectlReplay, ComparesMasksAndDrawsThem) {
  const TemporaryFolder folder;
  const std::string recording = folder / "recording";
  ASSERT_EQ(posectl({"synth", "--out", recording, "--frames", "15", "--size", "320x240", "--people", "2", "--quiet"}).exit_code,
            kExitOk);
  const std::vector<std::string> replay{"replay",  "--sequence", recording,           "--camera",     recording + "/camera.toml",
                                        "--quiet", "--draw",     folder / "pictures", "--mask-truth", recording + "/masks"};
  EXPECT_EQ(posectl(replay).exit_code, kExitUsage) << "only in lockstep";
  std::vector<std::string> lockstep = replay;
  lockstep.push_back("--lockstep");
  const Outcome outcome = posectl(lockstep);
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("IoU"));
  EXPECT_FALSE(std::filesystem::is_empty(folder / "pictures"));
}

TEST(PosectlBench, ComparesTheModesOnEverySequence) {
  const TemporaryFolder folder;
  const std::string recording = folder / "fr1_room";
  ASSERT_EQ(posectl({"synth", "--out", recording, "--frames", "15", "--size", "320x240", "--people", "0", "--quiet"}).exit_code,
            kExitOk);
  const std::string root = std::filesystem::path(recording).parent_path();
  const Outcome outcome =
      posectl({"bench", "tum", "--root", root, "--camera", recording + "/camera.toml", "--csv", folder / "table.csv", "--quiet"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("| fr1_room | off | 100.0 % |"));
  EXPECT_THAT(outcome.out, HasSubstr("| fr1_room | full | 100.0 % |"));
  EXPECT_TRUE(std::filesystem::exists(folder / "table.csv"));
}

TEST(PosectlBench, SaysWhatIsMissing) {
  const TemporaryFolder folder;
  const Outcome nothing = posectl({"bench", "tum", "--root", std::filesystem::path(folder / "x").parent_path()});
  EXPECT_EQ(nothing.exit_code, kExitNoInput);
  EXPECT_THAT(nothing.err, HasSubstr("rgb.txt"));
}

TEST(PosectlSynth, WritesARecordingThatCanBeReplayed) {
  const TemporaryFolder folder;
  const std::string recording = folder / "recording";
  const Outcome synth = posectl({"synth", "--out", recording, "--frames", "15", "--size", "320x240", "--people", "1", "--quiet"});
  ASSERT_EQ(synth.exit_code, kExitOk) << synth.err;
  EXPECT_EQ(posectl({"synth", "--out", recording, "--frames", "15"}).exit_code, kExitUsage);
  const Outcome replay = posectl({"replay", "--sequence", recording, "--camera", recording + "/camera.toml", "--lockstep",
                                  "--trajectory", folder / "final.txt", "--stats", folder / "stats.json", "--quiet"});
  ASSERT_EQ(replay.exit_code, kExitOk) << replay.err;
  EXPECT_EQ(nlohmann::json::parse(contents_of(folder / "stats.json")).at("frames"), 15);
  EXPECT_EQ(posectl({"eval", recording + "/groundtruth.txt", folder / "final.txt", "--frames", recording + "/rgb.txt"}).exit_code,
            kExitOk);
}

/// A log of LCM messages with these frame numbers, the last of them without a pose.
std::string write_log(const TemporaryFolder& folder, const std::vector<std::uint64_t>& sequences) {
  const std::string path = folder / "poses.lcm";
  lcm::LCM log("file://" + path + "?mode=w");
  EXPECT_TRUE(log.good());
  for (const std::uint64_t sequence : sequences) {
    PoseEstimate estimate;
    estimate.sequence = sequence;
    estimate.capture_ns = static_cast<TimeNs>(sequence) * 33 * kNsPerMs;
    estimate.state = sequence == sequences.back() ? TrackingState::Lost : TrackingState::Tracking;
    estimate.T_odom_camera = Se3(Eigen::Quaterniond::Identity(), {1, 2, 3});
    estimate.covariance = Matrix6d::Identity() * 1e-6;
    estimate.inliers = 123;
    const pose_t message = to_pose_message(estimate, Se3(), estimate.capture_ns + 5 * kNsPerMs);
    EXPECT_EQ(log.publish("TEST_POSE", &message), 0);
  }
  return "file://" + path + "?speed=0";
}

TEST(PosectlWatch, ReadsEveryPoseOfAStreamWithoutGaps) {
  const TemporaryFolder folder;
  const std::string url = write_log(folder, {0, 1, 2, 3});
  const Outcome outcome = posectl({"watch", "--url", url, "--prefix", "TEST_", "--csv", folder / "poses.csv", "--timeout", "5"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("received 4 poses (3 tracked), 0 gaps in sequence (0 missing)"));
  const std::string csv = contents_of(folder / "poses.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
  EXPECT_THAT(
      csv,
      HasSubstr(
          "tracking,1.000000000,2.000000000,3.000000000,0.000000000,0.000000000,0.000000000,1.000000000,0.001,0.001,0,0,123,0\n"));
  EXPECT_THAT(csv, HasSubstr("lost,,,,,,,,,,0,0,123,0\n"));
}

TEST(PosectlWatch, AGapIsANegativeAnswer) {
  const TemporaryFolder folder;
  const std::string url = write_log(folder, {0, 1, 4, 5});
  const Outcome outcome = posectl({"watch", "--url", url, "--prefix", "TEST_", "--timeout", "5"});
  EXPECT_EQ(outcome.exit_code, kExitNegative);
  EXPECT_THAT(outcome.out, HasSubstr("1 gaps in sequence (2 missing)"));
}

TEST(PosectlWatch, TheExpectedBeginningCounts) {
  const TemporaryFolder folder;
  const std::string url = write_log(folder, {2, 3, 4});
  EXPECT_EQ(posectl({"watch", "--url", url, "--prefix", "TEST_"}).exit_code, kExitOk);
  EXPECT_EQ(posectl({"watch", "--url", url, "--prefix", "TEST_", "--expect-from-sequence", "0"}).exit_code, kExitNegative);
}

TEST(PosectlWatch, EndsAtTheCount) {
  const TemporaryFolder folder;
  const std::string url = write_log(folder, {0, 1, 2, 3, 7});
  EXPECT_EQ(posectl({"watch", "--url", url, "--prefix", "TEST_", "--count", "4"}).exit_code, kExitOk);
  EXPECT_EQ(posectl({"watch", "--url", url, "--prefix", "TEST_", "--count", "6"}).exit_code, kExitNegative);
}

TEST(PosectlWatch, SaysWhereNothingCame) {
  const Outcome outcome = posectl({"watch", "--url", "memq://", "--timeout", "0.2"});
  EXPECT_EQ(outcome.exit_code, kExitNegative);
  EXPECT_THAT(outcome.err, HasSubstr("is posed running"));
}

TEST(PosectlWatch, AnUnknownUrlIsUnavailable) {
  const Outcome outcome = posectl({"watch", "--url", "nowhere://", "--timeout", "0.2"});
  EXPECT_EQ(outcome.exit_code, kExitUnavailable);
  EXPECT_THAT(outcome.err, HasSubstr("nowhere://"));
}

}  // namespace
}  // namespace posed
