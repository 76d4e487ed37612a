#include "drivers/fault_injection.h"

#include <cmath>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/frame_guard.h"
#include "drivers/rgbd_source.h"
#include "tests/support/stepping_clock.h"

namespace posed {
namespace {

constexpr TimeNs kDepthOffsetNs = 4 * kNsPerMs;

/// Frame n shows n everywhere and is taken at n periods.
class CountingSource final : public RgbdSource {
 public:
  explicit CountingSource(SteppingClock& clock) : clock_(clock) {
    info_.width = 8;
    info_.height = 6;
    info_.slots_held = 1;
  }
  const SourceInfo& info() const override { return info_; }
  Status start(FramePool& pool) override {
    pool_ = &pool;
    return {};
  }
  Capture next(std::stop_token) override {
    clock_.advance(33 * kNsPerMs);
    FrameWriter writer = *pool_->acquire();
    writer->sequence = next_++;
    writer->capture_ns = clock_.now_ns();
    writer->stamp_utc_ns = clock_.utc_ns(writer->capture_ns);
    writer->depth_offset_ns = kDepthOffsetNs;
    const auto value = static_cast<std::uint8_t>(writer->sequence + 1);
    for (int y = 0; y < info_.height; ++y) {
      std::fill_n(writer->bgr.row(y), info_.width * 3, value);
      std::fill_n(writer->gray.row(y), info_.width, value);
      std::fill_n(writer->depth_m.row(y), info_.width, static_cast<float>(value));
    }
    return {CaptureKind::Frame, std::move(writer).share(), {}};
  }

 private:
  SteppingClock& clock_;
  SourceInfo info_;
  FramePool* pool_ = nullptr;
  std::uint64_t next_ = 0;
};

class FaultInjection : public ::testing::Test {
 protected:
  void inject(const std::vector<std::string>& texts) {
    std::vector<Fault> faults;
    for (const std::string& text : texts) {
      faults.push_back(parse_fault(text).value());
    }
    source_ = with_faults(std::make_unique<CountingSource>(clock_), std::move(faults), clock_);
    ASSERT_TRUE(source_->start(pool_));
  }
  Capture next() { return source_->next({}); }

  SteppingClock clock_;
  FramePool pool_{8, 6, 8};
  std::unique_ptr<RgbdSource> source_;
};

TEST_F(FaultInjection, DropsThinsAndDoubles) {
  inject({"drop 1-2", "thin 4-9 3", "duplicate 11-11"});
  for (const std::uint64_t expected : {0U, 3U, 4U, 7U, 10U, 11U}) {
    const Capture capture = next();
    ASSERT_EQ(capture.kind, CaptureKind::Frame);
    EXPECT_EQ(capture.frame->sequence, expected);
  }
  EXPECT_EQ(next().kind, CaptureKind::SkippedFrame) << "the second copy";
  EXPECT_EQ(next().frame->sequence, 12U);
}

TEST_F(FaultInjection, SpoilsPixels) {
  inject({"black 0-0", "white 1-1", "zero_depth 2-2", "nan_depth 3-3", "half 4-4"});
  Capture capture = next();
  EXPECT_EQ(capture.frame->depth_offset_ns, kDepthOffsetNs);
  EXPECT_EQ(capture.frame->gray.at(7, 5), 0);
  EXPECT_EQ(capture.frame->bgr.at(7, 5), 0);
  EXPECT_EQ(capture.frame->depth_m.at(7, 5), 1.0F);
  EXPECT_EQ(next().frame->gray.at(7, 5), 255);
  EXPECT_EQ(next().frame->depth_m.at(7, 5), 0.0F);
  capture = next();
  EXPECT_TRUE(std::isnan(capture.frame->depth_m.at(7, 5)));
  EXPECT_EQ(capture.frame->gray.at(7, 5), 4);
  capture = next();
  EXPECT_EQ(capture.frame->gray.at(0, 2), 5);
  EXPECT_EQ(capture.frame->gray.at(0, 3), 0);
  EXPECT_EQ(capture.frame->depth_m.at(0, 3), 0.0F);
  EXPECT_EQ(next().frame->gray.at(0, 3), 6) << "later frames are whole";
}

TEST_F(FaultInjection, AFrozenImageIsKeptOutOnceItIsSeenToBeFrozen) {
  inject({"freeze 2-6"});
  next();
  EXPECT_EQ(next().frame->gray.at(0, 0), 2);
  for (int i = 0; i < FrameGuard::kRepeatsAllowed; ++i) {
    EXPECT_EQ(next().frame->gray.at(0, 0), 2);
  }
  for (int i = FrameGuard::kRepeatsAllowed; i < 5; ++i) {
    const Capture capture = next();
    EXPECT_EQ(capture.kind, CaptureKind::SkippedFrame);
    EXPECT_NE(capture.error.message.find("repeats one image"), std::string::npos);
  }
  EXPECT_EQ(next().frame->gray.at(0, 0), 8);
}

TEST_F(FaultInjection, StampsThatLeapAreKeptOut) {
  inject({"stamp 1-1 -0.05", "stamp 3-3 7"});
  EXPECT_EQ(next().kind, CaptureKind::Frame);
  EXPECT_EQ(next().kind, CaptureKind::SkippedFrame);
  EXPECT_EQ(next().kind, CaptureKind::Frame);
  EXPECT_EQ(next().error.message, "a frame's stamp is 7.000 s in the future");
  EXPECT_EQ(next().kind, CaptureKind::Frame);
}

TEST_F(FaultInjection, FaultsAddUp) {
  inject({"black 0-0", "zero_depth 0-0"});
  const Capture capture = next();
  EXPECT_EQ(capture.frame->gray.at(3, 3), 0);
  EXPECT_EQ(capture.frame->depth_m.at(3, 3), 0.0F);
}

TEST(ParseFault, ReadsAndRefuses) {
  const Fault fault = parse_fault("stamp 60-61 -0.5").value();
  EXPECT_EQ(fault.kind, FaultKind::Stamp);
  EXPECT_EQ(fault.first, 60U);
  EXPECT_EQ(fault.last, 61U);
  EXPECT_EQ(fault.amount, -0.5);
  for (const char* text : {"", "black", "gray 1-2", "black 1", "black 2-1", "black 1-2 3", "thin 1-2", "thin 1-2 1", "thin 1-2 2.5",
                           "stamp 1-2 soon", "stamp 1-2 nan", "black 1-2x", "black -1-2", "black 1-2 3 4"}) {
    const Result<Fault> refused = parse_fault(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(refused.error().message.find(std::string("fault \"") + text + "\""), std::string::npos);
  }
}

}  // namespace
}  // namespace posed
