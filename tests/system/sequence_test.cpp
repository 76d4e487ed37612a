// Whole sequences through the tool, as a user would run them: recording or synthetic world in, trajectory out.
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/recordings.h"
#include "tests/support/temporary_folder.h"
#include "tools/posectl/posectl.h"
#include "tools/posectl/trajectory_error.h"

namespace posed {
namespace {

struct Replayed {
  std::string final_text;
  std::string online_text;
  Trajectory trajectory;
};

/// Replays in lockstep what `arguments` name.
Replayed replay(std::vector<std::string> arguments) {
  const TemporaryFolder folder;
  arguments.insert(arguments.begin(), "replay");
  for (const std::string& argument : {std::string("--lockstep"), std::string("--quiet"), std::string("--trajectory"),
                                      folder / "final.txt", std::string("--online-trajectory"), folder / "online.txt"}) {
    arguments.push_back(argument);
  }
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(run_posectl(arguments, {out, err}), 0) << out.str() << err.str();
  Replayed replayed{contents_of(folder / "final.txt"), contents_of(folder / "online.txt"), {}};
  replayed.trajectory = parse_trajectory(replayed.final_text, "final.txt").value_or(Trajectory{});
  return replayed;
}

TEST(RecordedSequence, Freiburg1XyzIsTrackedWholeWithinOneAndAHalfCentimetresAndAlikeTwice) {
  const std::filesystem::path folder = recording_folder("tum_fr1_xyz");
  if (!std::filesystem::exists(folder / "rgb.txt")) {
    GTEST_SKIP() << "needs the recording tum_fr1_xyz; looked for " << folder << " (set POSED_TEST_DATA)";
  }
  const std::vector<std::string> arguments = {"--sequence", folder.string(), "--camera",
                                              POSED_SOURCE_DIR "/config/cameras/tum_fr1.toml"};
  const Replayed first = replay(arguments);
  EXPECT_EQ(first.trajectory.size(), read_frame_stamps(folder / "rgb.txt").value().size()) << "a frame has no pose";
  const auto error = evaluate_trajectory(read_trajectory(folder / "groundtruth.txt").value(), first.trajectory, {});
  ASSERT_TRUE(error) << error.error().message;
  EXPECT_LE(error->ate_m.rmse, 0.015);

  const Replayed second = replay(arguments);
  EXPECT_EQ(first.final_text, second.final_text);
  EXPECT_EQ(first.online_text, second.online_text);
}

TEST(SyntheticSequence, AnEmptyRoomIsTrackedWholeAndAlikeTwice) {
  const TemporaryFolder folder;
  const std::vector<std::string> arguments = {"--synthetic", "--people", "0", "--seed", "3", "--duration", "4"};
  std::vector<std::string> with_truth = arguments;
  with_truth.insert(with_truth.end(), {"--groundtruth", folder / "truth.txt"});
  const Replayed first = replay(with_truth);
  EXPECT_EQ(first.trajectory.size(), 120U);
  const auto error = evaluate_trajectory(read_trajectory(folder / "truth.txt").value(), first.trajectory, {});
  ASSERT_TRUE(error) << error.error().message;
  EXPECT_LE(error->ate_m.rmse, 0.02);
  const Replayed second = replay(arguments);
  EXPECT_EQ(first.final_text, second.final_text);
  EXPECT_EQ(first.online_text, second.online_text);
}

}  // namespace
}  // namespace posed
