#include "drivers/tum_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/tum_sequence.h"
#include "tests/support/test_recording.h"

namespace posed {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// A writer of an empty folder, and one frame to give to it.
class TumWriterFrames : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(writer_); }

  TemporaryFolder folder_;
  Result<TumWriter> writer_ = TumWriter::create(folder_.path(), {});
  FramePool pool_{kTestWidth, kTestHeight, 1};
  FrameWriter frame_ = *pool_.acquire();
};

TEST(TumWriter, WritesTheLayout) {
  const TemporaryFolder folder;
  write_recording(folder.path() / "new" / "recording", 2, ColorFormat::Jpeg);
  const std::filesystem::path root = folder.path() / "new" / "recording";
  EXPECT_EQ(text_of(root / "rgb.txt"),
            "# color images\n# timestamp filename\n"
            "1305031102.175304001 rgb/1305031102.175304001.jpg\n"
            "1305031102.208637334 rgb/1305031102.208637334.jpg\n");
  EXPECT_THAT(text_of(root / "depth.txt"), StartsWith("# depth maps\n# timestamp filename\n1305031102.175304001 depth/"));
  EXPECT_TRUE(std::filesystem::exists(root / "depth" / "1305031102.208637334.png"));
  EXPECT_FALSE(std::filesystem::exists(root / "groundtruth.txt")) << "these frames carry no true pose";
}

TEST_F(TumWriterFrames, GroundTruthStandsWhereFramesCarryIt) {
  paint(*frame_, 0);
  frame_->stamp_utc_ns = 1'500'000'000;
  frame_->T_world_camera_truth = Se3(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), {1.0, -2.0, 0.125});
  ASSERT_TRUE(writer_->add_frame(*frame_));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "rgb.txt")) << "no list before it is committed";
  ASSERT_TRUE(writer_->commit());
  EXPECT_EQ(text_of(folder_.path() / "groundtruth.txt"),
            "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n"
            "1.500000000 1.000000000 -2.000000000 0.125000000 1.000000000 0.000000000 0.000000000 0.000000000\n");
}

TEST(TumWriter, WhatItWritesPairsExactly) {
  const TemporaryFolder folder;
  write_recording(folder.path(), 5);
  ReplayConfig config;
  config.sequence = folder.path().string();
  config.max_stamp_difference_s = 0;
  const Result<TumSequence> sequence = load_tum_sequence(config);
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->pairs.size(), 5U);
  EXPECT_EQ(sequence->pairs[4].color.stamp_ns, kTestStampNs + 4 * kTestPeriodNs);
  EXPECT_EQ(sequence->period_ns, kTestPeriodNs);
}

TEST_F(TumWriterFrames, DepthKeepsItsOwnTime) {
  // The third frame has the depth image of the second: a list has no stamp twice, so it is a nanosecond later.
  const std::vector<TimeNs> offsets{-7 * kNsPerMs, 16 * kNsPerMs, 16 * kNsPerMs - kTestPeriodNs};
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    paint(*frame_, static_cast<int>(i));
    frame_->stamp_utc_ns = kTestStampNs + static_cast<TimeNs>(i) * kTestPeriodNs;
    frame_->depth_offset_ns = offsets[i];
    ASSERT_TRUE(writer_->add_frame(*frame_));
  }
  ASSERT_TRUE(writer_->commit());
  ReplayConfig config;
  config.sequence = folder_.path().string();
  const Result<TumSequence> sequence = load_tum_sequence(config);
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->pairs.size(), 3U);
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const TumAssociation& pair = sequence->pairs[i];
    EXPECT_NEAR(static_cast<double>(pair.depth.stamp_ns - pair.color.stamp_ns), static_cast<double>(offsets[i]), 1.0) << i;
  }
}

TEST(TumWriter, NeverWritesIntoARecording) {
  const TemporaryFolder folder;
  write_recording(folder.path(), 1);
  const Result<TumWriter> writer = TumWriter::create(folder.path(), {});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(writer.error().message, HasSubstr("holds a recording already"));
}

TEST_F(TumWriterFrames, StampsMustGrow) {
  frame_->stamp_utc_ns = 10;
  ASSERT_TRUE(writer_->add_frame(*frame_));
  EXPECT_FALSE(writer_->add_frame(*frame_));
}

TEST(TumWriter, AFolderThatCannotBeMadeIsNamed) {
  const TemporaryFolder folder;
  write_text(folder.path() / "file", "");
  const Result<TumWriter> writer = TumWriter::create(folder.path() / "file", {});
  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().message, HasSubstr("file/rgb"));
}

}  // namespace
}  // namespace posed
