#include "daemon/capture_stage.h"

#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

/// Delivers what a list says: a kind, and for a frame its number in the source's count.
class ListedSource final : public RgbdSource {
 public:
  struct Entry {
    CaptureKind kind;
    std::uint64_t sequence = 0;
  };
  explicit ListedSource(std::vector<Entry> entries) : entries_(std::move(entries)) {}

  const SourceInfo& info() const override { return info_; }
  Status start(FramePool& pool) override {
    pool_ = &pool;
    return {};
  }
  Capture next(std::stop_token /*stop*/) override {
    Capture capture;
    if (next_ == entries_.size()) {
      capture.kind = CaptureKind::EndOfStream;
      return capture;
    }
    const Entry entry = entries_[next_++];
    capture.kind = entry.kind;
    if (entry.kind == CaptureKind::Frame) {
      FrameWriter frame = *pool_->acquire();
      frame->sequence = entry.sequence;
      capture.frame = std::move(frame).share();
    }
    return capture;
  }

 private:
  SourceInfo info_;
  std::vector<Entry> entries_;
  std::size_t next_ = 0;
  FramePool* pool_ = nullptr;
};

HealthReport report_of(std::vector<ListedSource::Entry> entries) {
  ListedSource source(std::move(entries));
  FramePool pool(8, 8, 2);
  CaptureStage stage(source, pool, {});
  EXPECT_TRUE(stage.begin());
  FrameRef frame;
  while (stage.next({}, frame)) {
    frame = FrameRef();
  }
  HealthReport health;
  stage.report(health);
  return health;
}

constexpr CaptureKind kFrame = CaptureKind::Frame;

TEST(CaptureStage, CountsGapsInTheSourcesCount) {
  const HealthReport health = report_of({{kFrame, 0}, {kFrame, 1}, {kFrame, 4}, {kFrame, 5}, {kFrame, 9}});
  EXPECT_EQ(health.frames_captured, 5U);
  EXPECT_EQ(health.frames_missed, 5U);
}

TEST(CaptureStage, DoesNotCountAgainWhatIsCountedAsSkippedOrWithoutSlot) {
  const HealthReport health = report_of({{kFrame, 0}, {CaptureKind::SkippedFrame}, {CaptureKind::NoFreeSlot}, {kFrame, 3}});
  EXPECT_EQ(health.frames_missed, 0U);
  EXPECT_EQ(health.frames_skipped, 1U);
  EXPECT_EQ(health.frames_no_slot, 1U);
}

TEST(CaptureStage, SkippedListLinesThatWereNeverFramesHideNoLaterGap) {
  const HealthReport health = report_of({{CaptureKind::SkippedFrame}, {CaptureKind::SkippedFrame}, {kFrame, 0}, {kFrame, 2}});
  EXPECT_EQ(health.frames_missed, 1U);
}

TEST(CaptureStage, LetsFramesGoWhilePausedAndMissesNone) {
  ListedSource source({{kFrame, 0}, {kFrame, 1}, {CaptureKind::SkippedFrame}, {kFrame, 3}, {kFrame, 5}});
  FramePool pool(8, 8, 2);
  CaptureStage stage(source, pool, {});
  ASSERT_TRUE(stage.begin());
  std::vector<bool> handed_on;
  for (const bool paused : {false, true, true, true, false}) {
    stage.set_paused(paused);
    FrameRef frame;
    ASSERT_TRUE(stage.next({}, frame));
    handed_on.push_back(static_cast<bool>(frame));
  }
  EXPECT_EQ(handed_on, (std::vector<bool>{true, false, false, false, true}));
  EXPECT_EQ(pool.free_slots(), 2U);
  HealthReport health;
  stage.report(health);
  EXPECT_FALSE(health.paused);
  EXPECT_EQ(health.frames_captured, 4U);
  EXPECT_EQ(health.frames_paused, 2U);
  EXPECT_EQ(health.frames_skipped, 1U);
  EXPECT_EQ(health.frames_missed, 1U);
  stage.set_paused(true);
  stage.report(health);
  EXPECT_TRUE(health.paused);
}

}  // namespace
}  // namespace posed
