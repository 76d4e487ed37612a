#include "tools/posectl/trajectory.h"

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string message_of(const std::string& text) {
  const Result<Trajectory> trajectory = parse_trajectory(text, "poses.txt");
  EXPECT_FALSE(trajectory) << text;
  if (trajectory) {
    return "";
  }
  EXPECT_EQ(trajectory.error().code, ErrorCode::BadData);
  return trajectory.error().message;
}

TEST(TrajectoryStamp, IsExactToTheNanosecond) {
  EXPECT_EQ(parse_trajectory_stamp("1305031102.175304"), 1'305'031'102'175'304'000);
  EXPECT_EQ(parse_trajectory_stamp("1305031098.6659"), 1'305'031'098'665'900'000);
  EXPECT_EQ(parse_trajectory_stamp("1305031098.123456789"), 1'305'031'098'123'456'789);
  EXPECT_EQ(parse_trajectory_stamp("0"), 0);
  EXPECT_EQ(parse_trajectory_stamp("7"), 7'000'000'000);
  EXPECT_EQ(parse_trajectory_stamp(".5"), 500'000'000);
  EXPECT_EQ(parse_trajectory_stamp("3."), 3'000'000'000);
}

TEST(TrajectoryStamp, RoundsBeyondNineDecimals) {
  EXPECT_EQ(parse_trajectory_stamp("1.1234567894"), 1'123'456'789);
  EXPECT_EQ(parse_trajectory_stamp("1.1234567895"), 1'123'456'790);
  EXPECT_EQ(parse_trajectory_stamp("0.9999999999"), 1'000'000'000);
}

TEST(TrajectoryStamp, ReadsExponentsExactly) {
  EXPECT_EQ(parse_trajectory_stamp("1.305031102175304000e+09"), 1'305'031'102'175'304'000);
  EXPECT_EQ(parse_trajectory_stamp("5e-9"), 5);
  EXPECT_EQ(parse_trajectory_stamp("5e-10"), 1);
  EXPECT_EQ(parse_trajectory_stamp("4e-10"), 0);
  EXPECT_EQ(parse_trajectory_stamp("4e-50"), 0);
}

TEST(TrajectoryStamp, RefusesWhatIsNoStamp) {
  for (const char* text : {"", ".", "-1", "+1", "1.2.3", "1x", "nan", "inf", "1e", "1e+", "1e1000", "9300000000", "0x10", "1e20"}) {
    const Result<std::int64_t> stamp = parse_trajectory_stamp(text);
    ASSERT_FALSE(stamp) << text;
    EXPECT_EQ(stamp.error().code, ErrorCode::InvalidArgument) << text;
  }
}

TEST(TrajectoryStamp, IsWrittenWithSixDecimalsOrNine) {
  EXPECT_EQ(format_trajectory_stamp(1'305'031'102'175'304'000), "1305031102.175304");
  EXPECT_EQ(format_trajectory_stamp(33'333'333), "0.033333333");
  EXPECT_EQ(format_trajectory_stamp(0), "0.000000");
}

TEST(TrajectoryStamp, SurvivesTheRoundTrip) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> stamps(0, 9'000'000'000'000'000'000);
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t stamp_ns = stamps(random);
    ASSERT_EQ(parse_trajectory_stamp(format_trajectory_stamp(stamp_ns)), stamp_ns);
  }
}

TEST(ParseTrajectory, ReadsPosesBetweenCommentsAndEmptyLines) {
  const Result<Trajectory> trajectory = parse_trajectory(
      "# a comment\n\n1.5 1 2 3 0 0 0 1\r\n  2.5,4,5,6,0,0,1,0\n#2.6 not a pose\n3.5\t7 8 9 0.5 0.5 0.5 0.5", "poses.txt");
  ASSERT_TRUE(trajectory) << trajectory.error().message;
  ASSERT_EQ(trajectory->size(), 3u);
  EXPECT_EQ((*trajectory)[0].stamp_ns, 1'500'000'000);
  EXPECT_EQ((*trajectory)[1].T_world_camera.translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ((*trajectory)[1].T_world_camera.rotation().z(), 1.0);
  // A third of a turn about (1, 1, 1) takes x to y.
  EXPECT_TRUE(((*trajectory)[2].T_world_camera.rotation() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
}

TEST(ParseTrajectory, AnEmptyFileIsAnEmptyTrajectory) {
  EXPECT_TRUE(parse_trajectory("", "poses.txt")->empty());
  EXPECT_TRUE(parse_trajectory("# nothing\n", "poses.txt")->empty());
}

TEST(ParseTrajectory, NamesFileAndLineOfAWrongCountOfFields) {
  EXPECT_EQ(message_of("# c\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n"),
            "poses.txt:3: 7 fields where a pose has 8: stamp tx ty tz qx qy qz qw");
  EXPECT_THAT(message_of("1 0 0 0 0 0 0 1 9\n"), HasSubstr("poses.txt:1: 9 fields"));
}

TEST(ParseTrajectory, NamesTheFieldThatIsNoNumber) {
  EXPECT_EQ(message_of("1 0 zero 0 0 0 0 1\n"), "poses.txt:1: field 3, \"zero\", is not a finite number");
  EXPECT_THAT(message_of("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n"), HasSubstr("poses.txt:2: field 2, \"nan\""));
  EXPECT_THAT(message_of("1 0 0 0 0 0 0 1.0f\n"), HasSubstr("field 8, \"1.0f\""));
  EXPECT_THAT(message_of("then 0 0 0 0 0 0 1\n"), HasSubstr("poses.txt:1: stamp \"then\""));
}

TEST(ParseTrajectory, RefusesAQuaternionThatIsNotOfUnitLength) {
  EXPECT_THAT(message_of("1 0 0 0 0 0 0 0\n"), HasSubstr("poses.txt:1: the quaternion's length is 0, not 1"));
  EXPECT_THAT(message_of("1 0 0 0 1 0 0 1\n"), HasSubstr("length is 1.414"));
}

TEST(ParseTrajectory, NormalisesRoundedQuaternions) {
  const Result<Trajectory> trajectory = parse_trajectory("1 0 0 0 0.6132 0.5962 -0.3311 -0.3986\n", "poses.txt");
  ASSERT_TRUE(trajectory);
  EXPECT_NEAR(trajectory->front().T_world_camera.rotation().norm(), 1.0, 1e-15);
}

TEST(ParseTrajectory, ReportsStampsThatRepeatOrGoBack) {
  EXPECT_EQ(message_of("1 0 0 0 0 0 0 1\n1.000 0 0 0 0 0 0 1\n"), "poses.txt:2: stamp 1.000 stands here for the second time");
  EXPECT_EQ(message_of("2 0 0 0 0 0 0 1\n1.5 0 0 0 0 0 0 1\n"),
            "poses.txt:2: stamp 1.5 is earlier than 2.000000 before it; sort the file by stamps");
}

TEST(ReadTrajectory, NamesTheMissingFile) {
  const Result<Trajectory> trajectory = read_trajectory("/nonexistent/poses.txt");
  ASSERT_FALSE(trajectory);
  EXPECT_EQ(trajectory.error().code, ErrorCode::NotFound);
}

TEST(FormatTrajectory, IsReadBackToTheNanometre) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  Trajectory trajectory;
  for (int i = 0; i < 200; ++i) {
    const Vector6d xi = Vector6d::NullaryExpr([&](Eigen::Index) { return normal(random); });
    trajectory.push_back({1'305'031'102'175'304'000 + i * std::int64_t{33'333'333}, Se3::exp(xi)});
  }
  const Result<Trajectory> read = parse_trajectory(format_trajectory(trajectory), "poses.txt");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp_ns, trajectory[i].stamp_ns);
    EXPECT_LT((trajectory[i].T_world_camera.inverse() * (*read)[i].T_world_camera).log().norm(), 5e-9);
  }
}

TEST(ReadFrameStamps, ReadsAnImageList) {
  const TemporaryFolder folder;
  const Result<std::vector<std::int64_t>> stamps =
      read_frame_stamps(folder.write("rgb.txt", "# t f\n1.5 rgb/1.png\n2.5 rgb/2.png\n"));
  ASSERT_TRUE(stamps) << stamps.error().message;
  EXPECT_THAT(*stamps, ElementsAre(1'500'000'000, 2'500'000'000));
}

TEST(ReadFrameStamps, NamesTheLineOfAFrameWithoutImage) {
  const TemporaryFolder folder;
  const std::string path = folder.write("rgb.txt", "1.5 rgb/1.png\n2.5\n");
  const Result<std::vector<std::int64_t>> stamps = read_frame_stamps(path);
  ASSERT_FALSE(stamps);
  EXPECT_EQ(stamps.error().message, path + ":2: a frame needs a stamp and a path");
}

}  // namespace
}  // namespace posed
