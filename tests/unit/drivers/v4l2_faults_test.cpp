#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/v4l2_rig.h"

namespace posed::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;

class V4l2Faults : public testing::Test, public V4l2Rig {
 protected:
  V4l2Faults() : pool_(kRigWidth, kRigHeight, 4), source_(source(pool_)) {}

  /// What the source delivers until `time_ns`; the frames' sequences and stamps, and the messages of the rest.
  void run_until(TimeNs time_ns) {
    std::stop_source stop;
    clock_.at(time_ns, [&stop] { stop.request_stop(); });
    while (clock_.now_ns() < time_ns) {
      const Capture got = source_->next(stop.get_token());
      if (got.kind == CaptureKind::Interrupted) {
        interruptions_.push_back(got.error.message);
      } else if (got.kind == CaptureKind::SkippedFrame) {
        skipped_.push_back(got.error.message);
      } else if (got.kind == CaptureKind::Frame) {
        EXPECT_TRUE(stamps_.empty() || got.frame->capture_ns > stamps_.back());
        EXPECT_TRUE(sequences_.empty() || got.frame->sequence > sequences_.back());
        stamps_.push_back(got.frame->capture_ns);
        depth_offsets_.push_back(got.frame->depth_offset_ns);
        sequences_.push_back(got.frame->sequence);
      } else {
        EXPECT_EQ(got.kind, CaptureKind::Stopped) << got.error.message;
      }
    }
  }
  void run_for(double seconds) { run_until(clock_.now_ns() + from_seconds(seconds)); }

  void forget() {
    stamps_.clear();
    depth_offsets_.clear();
    sequences_.clear();
    interruptions_.clear();
    skipped_.clear();
  }

  std::size_t frames_missed() const {
    return sequences_.empty() ? 0 : sequences_.back() - sequences_.front() + 1 - sequences_.size();
  }

  /// Both nodes stream, once; a buffer or two are out, being read or waiting for a partner.
  void expect_streaming() {
    EXPECT_TRUE(source_->health().connected);
    EXPECT_EQ(kernel_.open_descriptors(), 2U);
    EXPECT_EQ(kernel_.mappings(), 8U);
    EXPECT_GE(kernel_.queued_buffers(kColorPath), 2U);
    EXPECT_GE(kernel_.queued_buffers(kDepthPath), 2U);
    EXPECT_THAT(kernel_.violations(), IsEmpty());
  }

  void expect_closed() {
    EXPECT_FALSE(source_->health().connected);
    EXPECT_EQ(kernel_.open_descriptors(), 0U);
    EXPECT_EQ(kernel_.mappings(), 0U);
    EXPECT_THAT(kernel_.violations(), IsEmpty());
  }

  /// The first frame comes within 2 s of `since_ns`, and then 30 a second.
  void expect_frames_again(TimeNs since_ns) {
    forget();
    run_until(since_ns + 2 * kNsPerSecond);
    ASSERT_FALSE(stamps_.empty());
    forget();
    run_for(1.0);
    EXPECT_GE(stamps_.size(), 29U);
    EXPECT_EQ(frames_missed(), 0U);
    expect_streaming();
  }

  FramePool pool_;
  std::unique_ptr<RgbdSource> source_;
  std::vector<TimeNs> stamps_;
  std::vector<TimeNs> depth_offsets_;  // of the same frames
  std::vector<std::uint64_t> sequences_;
  std::vector<std::string> interruptions_;
  std::vector<std::string> skipped_;
};

TEST_F(V4l2Faults, NoneInTenSeconds) {
  run_for(10.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 299, 1);
  EXPECT_EQ(frames_missed(), 0U);
  EXPECT_EQ(source_->health().unpaired, 0U);
  EXPECT_THAT(interruptions_, IsEmpty());
  expect_streaming();
  source_.reset();
  EXPECT_EQ(kernel_.open_descriptors(), 0U);
  EXPECT_EQ(kernel_.mappings(), 0U);
}

TEST_F(V4l2Faults, MonotonicStampsAreUsedAsTheyAre) {
  color_->rate_hz = depth_->rate_hz = 25;
  color_->phase_ns = 7 * kNsPerMs;
  depth_->phase_ns = 10 * kNsPerMs;
  run_for(1.0);
  ASSERT_GE(stamps_.size(), 20U);
  for (const TimeNs stamp_ns : stamps_) {
    EXPECT_EQ(stamp_ns % (40 * kNsPerMs), 7 * kNsPerMs) << "the colour image's";
  }
  EXPECT_THAT(depth_offsets_, Each(3 * kNsPerMs));
}

TEST_F(V4l2Faults, StampsOfAnotherClockAreBroughtToOurs) {
  depth_->stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
  depth_->clock_offset_ns = 1000 * kNsPerSecond;
  color_->stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  color_->clock_offset_ns = 77 * kNsPerSecond;
  const TimeNs begin_ns = clock_.now_ns();
  run_for(10.0);
  EXPECT_GE(stamps_.size(), 298U);
  EXPECT_GE(stamps_.front(), begin_ns);
  EXPECT_LE(stamps_.back(), clock_.now_ns());
  EXPECT_EQ(source_->health().unpaired, 0U);
}

TEST_F(V4l2Faults, WhatClaimsToBeMonotonicAndIsNotIsFoundOut) {
  color_->clock_offset_ns = kNsPerSecond;  // in the future
  run_for(5.0);
  EXPECT_GE(stamps_.size(), 148U);
  EXPECT_EQ(source_->health().clock_resets, 0U) << "it is not the clock that was set";
}

TEST_F(V4l2Faults, StampsThatGoBackAndStayThere) {
  color_->fate = [](std::uint64_t sequence) { return FakeImage{.stamp_shift_ns = sequence < 60 ? 0 : -kNsPerSecond}; };
  run_for(1.9);
  forget();
  run_for(2.0);
  EXPECT_GE(stamps_.size(), 58U);
  EXPECT_EQ(source_->health().clock_resets, 1U);
  expect_streaming();
}

TEST_F(V4l2Faults, OneStampThatGoesBack) {
  color_->fate = [](std::uint64_t sequence) { return FakeImage{.stamp_shift_ns = sequence == 60 ? -100 * kNsPerMs : 0}; };
  run_for(1.9);
  forget();
  run_for(2.0);
  EXPECT_GE(stamps_.size(), 58U);
  expect_streaming();
}

TEST_F(V4l2Faults, UnplugAndReplugMidStream) {
  for (const char* path : {kColorPath, kDepthPath}) {
    run_for(1.0);
    forget();
    clock_.at(clock_.now_ns() + 10 * kNsPerMs, [&] { kernel_.unplug(path); });
    run_for(10.0);
    EXPECT_THAT(interruptions_, Contains(AllOf(HasSubstr(path), HasSubstr("No such"))));
    EXPECT_LE(stamps_.size(), 1U);
    EXPECT_LE(interruptions_.size(), 2U) << "each reason is told once";
    expect_closed();
    kernel_.replug(path);
    expect_frames_again(clock_.now_ns());
  }
  EXPECT_EQ(source_->health().reconnects, 2U);
}

TEST_F(V4l2Faults, UnplugOfTheOneWhileTheOtherIsQuiet) {
  run_for(1.0);
  kernel_.silence(kColorPath, clock_.now_ns() + 60 * kNsPerSecond);
  kernel_.unplug(kDepthPath);
  forget();
  run_for(0.1);
  EXPECT_THAT(interruptions_, Contains(HasSubstr(kDepthPath)));
  kernel_.silence(kColorPath, 0);
  kernel_.replug(kDepthPath);
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, AnErrorOfTheStream) {
  run_for(1.0);
  forget();
  kernel_.break_streaming(kDepthPath);
  run_for(0.03);
  EXPECT_THAT(interruptions_, Contains(AllOf(HasSubstr(kDepthPath), HasSubstr("DQBUF"), HasSubstr("Input/output error"))));
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, ADeviceThatHangsUpAndSaysNoMore) {
  run_for(1.0);
  forget();
  kernel_.break_streaming(kColorPath, EAGAIN);
  run_for(0.03);
  EXPECT_THAT(interruptions_, Contains(AllOf(HasSubstr(kColorPath), HasSubstr("hung up"))));
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, ABufferThatCannotBeGivenBack) {
  run_for(1.0);
  forget();
  kernel_.refuse(kColorPath, VIDIOC_QBUF, EIO);
  run_for(0.2);
  EXPECT_THAT(interruptions_, Contains(AllOf(HasSubstr(kColorPath), HasSubstr("QBUF"))));
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, AStallOfFiveSeconds) {
  for (const char* path : {kColorPath, kDepthPath}) {
    run_for(1.0);
    forget();
    const TimeNs back_ns = clock_.now_ns() + 5 * kNsPerSecond;
    kernel_.silence(path, back_ns);
    run_until(back_ns);
    EXPECT_THAT(interruptions_, Contains(HasSubstr("no frame for 1.0 s")));
    EXPECT_FALSE(source_->health().connected);
    expect_frames_again(back_ns);
  }
  EXPECT_GE(source_->health().stalls, 4U);
}

TEST_F(V4l2Faults, HalfFilledBuffers) {
  color_->fate = [](std::uint64_t sequence) { return FakeImage{.filled = sequence % 10 == 5 ? 0.5 : 1.0}; };
  run_for(3.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 81, 2);
  EXPECT_THAT(skipped_, Contains(AllOf(HasSubstr(kColorPath), HasSubstr("128 bytes of 256"))));
  EXPECT_NEAR(static_cast<double>(skipped_.size()), 9, 1);
  EXPECT_THAT(interruptions_, IsEmpty());
  color_->fate = nullptr;
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, BuffersThatTheDriverFlags) {
  depth_->fate = [](std::uint64_t sequence) { return FakeImage{.damaged = sequence % 10 == 5}; };
  run_for(3.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 81, 2);
  EXPECT_THAT(skipped_, Contains(AllOf(HasSubstr(kDepthPath), HasSubstr("damaged"))));
  EXPECT_NEAR(static_cast<double>(source_->health().unpaired), 9, 1) << "colour images whose depth was damaged";
  depth_->fate = nullptr;
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, DroppedImagesAreGapsInTheSequence) {
  color_->fate = [](std::uint64_t sequence) { return FakeImage{.dropped = sequence % 10 == 3}; };
  depth_->fate = [](std::uint64_t sequence) { return FakeImage{.dropped = sequence % 10 == 7}; };
  run_for(10.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 239, 2);
  EXPECT_NEAR(static_cast<double>(frames_missed()), 60, 2);
  EXPECT_NEAR(static_cast<double>(source_->health().unpaired), 60, 2);
  EXPECT_THAT(interruptions_, IsEmpty());
  color_->fate = nullptr;
  depth_->fate = nullptr;
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, DepthThatComesLateFindsItsColour) {
  depth_->delay_ns = 66 * kNsPerMs;  // nearly two periods
  run_for(10.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 297, 2);
  EXPECT_EQ(source_->health().unpaired, 0U);
  config_.v4l2.buffers = 8;
  depth_->delay_ns = 180 * kNsPerMs;
  source_ = source(pool_);
  forget();
  run_for(10.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 294, 2);
  EXPECT_EQ(source_->health().unpaired, 0U);
}

TEST_F(V4l2Faults, ASlowerDepthCameraCountsTheFrames) {
  depth_->rate_hz = 15;
  run_for(10.0);
  EXPECT_NEAR(static_cast<double>(stamps_.size()), 149, 2);
  EXPECT_EQ(frames_missed(), 0U);
}

TEST_F(V4l2Faults, OpeningIsTriedAgain) {
  struct Refusal {
    unsigned long request;
    int error;
    const char* words;
  };
  for (const Refusal& refusal :
       {Refusal{0, EBUSY, "another program"}, Refusal{0, EACCES, "group"}, Refusal{VIDIOC_QUERYCAP, EIO, "QUERYCAP"},
        Refusal{VIDIOC_S_FMT, EBUSY, "another program"}, Refusal{VIDIOC_REQBUFS, EINVAL, "REQBUFS of 4 buffers"},
        Refusal{VIDIOC_REQBUFS, ENOMEM, "REQBUFS"}, Refusal{VIDIOC_QUERYBUF, EINVAL, "QUERYBUF"},
        Refusal{VIDIOC_QBUF, EINVAL, "QBUF"}, Refusal{VIDIOC_STREAMON, ENOSPC, "bandwidth"},
        Refusal{VIDIOC_STREAMON, EINVAL, "STREAMON"}}) {
    for (const char* path : {kColorPath, kDepthPath}) {
      source_ = source(pool_);
      forget();
      kernel_.refuse(path, refusal.request, refusal.error);
      const Capture got = source_->next({});
      ASSERT_EQ(got.kind, CaptureKind::Interrupted) << refusal.words;
      EXPECT_THAT(got.error.message, AllOf(HasSubstr(path), HasSubstr(refusal.words)));
      expect_closed();
      expect_frames_again(clock_.now_ns());
    }
  }
}

TEST_F(V4l2Faults, AnotherProgramHasTheCamera) {
  const std::unique_ptr<V4l2Camera> other = camera();
  ASSERT_TRUE(other->open());
  const Capture got = source_->next({});
  EXPECT_EQ(got.kind, CaptureKind::Interrupted);
  EXPECT_EQ(got.error.code, ErrorCode::Unavailable);
  EXPECT_THAT(got.error.message, HasSubstr("another program"));
  other->close();
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, TheDriverMayGiveMoreBuffersOrFewer) {
  color_->least_buffers = 6;
  depth_->most_buffers = 2;
  run_for(2.0);
  EXPECT_EQ(kernel_.mappings(), 8U);
  EXPECT_GE(stamps_.size(), 58U);
  depth_->most_buffers = 1;
  depth_->least_buffers = 1;
  source_ = source(pool_);
  const Capture got = source_->next({});
  EXPECT_THAT(got.error.message, AllOf(HasSubstr(kDepthPath), HasSubstr("asked for 4 buffers, the driver gives 1")));
}

TEST_F(V4l2Faults, AReaderThatIsLateFindsOldImagesAndThenNewOnes) {
  run_for(1.0);
  forget();
  clock_.advance(3 * kNsPerSecond);
  run_for(1.0);
  EXPECT_GE(stamps_.size(), 29U);
  EXPECT_LE(stamps_.size(), 34U) << "no more than the driver has buffers for";
  EXPECT_NEAR(static_cast<double>(frames_missed()), 87, 3);
  EXPECT_THAT(interruptions_, IsEmpty());
  expect_streaming();
}

TEST_F(V4l2Faults, ReadKeepsToItsTime) {
  const std::unique_ptr<V4l2Camera> opened = camera();
  ASSERT_TRUE(opened->open());
  kernel_.silence(kDepthPath, 60 * kNsPerSecond);  // colour comes, and finds no partner
  const TimeNs begin_ns = clock_.now_ns();
  const CameraRead got = opened->read(nullptr, 200 * kNsPerMs);
  EXPECT_EQ(got.kind, CameraReadKind::Nothing);
  EXPECT_EQ(clock_.now_ns() - begin_ns, 200 * kNsPerMs);
  EXPECT_EQ(opened->read(nullptr, 0).kind, CameraReadKind::Nothing);
  EXPECT_EQ(clock_.now_ns() - begin_ns, 200 * kNsPerMs);
}

TEST_F(V4l2Faults, AFullPoolLosesFramesAndKeepsTheCamera) {
  run_for(0.5);
  std::vector<FrameWriter> held;
  while (std::optional<FrameWriter> writer = pool_.acquire()) {
    held.push_back(std::move(*writer));
  }
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(source_->next({}).kind, CaptureKind::NoFreeSlot);
  }
  held.clear();
  expect_frames_again(clock_.now_ns());
}

TEST_F(V4l2Faults, TheDriversCountOf32BitsWrapsAround) {
  V4l2Stream stream(kernel_, clock_, config_.v4l2, {.formats = v4l2_color_formats(), .width = kRigWidth, .height = kRigHeight});
  kernel_.count_from(kColorPath, 0xfffffffeU);
  ASSERT_TRUE(stream.open());
  std::vector<std::uint64_t> counts;
  while (counts.size() < 4) {
    const V4l2Take took = stream.wait(kNsPerSecond);
    ASSERT_EQ(took.kind, CameraReadKind::Frame);
    counts.push_back(took.image.sequence);
    stream.give_back(took.image.buffer);
  }
  EXPECT_THAT(counts, testing::ElementsAre(0xfffffffeU, 0xffffffffU, 0x100000000U, 0x100000001U));
}

std::ptrdiff_t entries_of(const char* folder) {
  return std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator());
}

TEST_F(V4l2Faults, AThreadThatReconnectsAHundredTimesLeaksNothing) {
  run_for(0.5);
  const std::ptrdiff_t descriptors = entries_of("/proc/self/fd");
  const std::ptrdiff_t tasks = entries_of("/proc/self/task");
  std::size_t frames = 0;
  std::jthread([&] {
    for (int i = 0; i < 100; ++i) {
      const char* path = i % 2 == 0 ? kColorPath : kDepthPath;
      kernel_.unplug(path);
      run_for(0.5);
      kernel_.replug(path);
      forget();
      run_for(2.0);
      frames += stamps_.size();
    }
  }).join();
  EXPECT_GE(frames, 100U * 30U);
  EXPECT_EQ(entries_of("/proc/self/fd"), descriptors);
  EXPECT_EQ(entries_of("/proc/self/task"), tasks);
  EXPECT_EQ(source_->health().reconnects, 100U);
  expect_streaming();
}

}  // namespace
}  // namespace posed::test
