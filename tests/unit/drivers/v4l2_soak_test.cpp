#include <cstdlib>
#include <fstream>
#include <malloc.h>
#include <random>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/v4l2_rig.h"

namespace posed::test {
namespace {

constexpr double kHours = 4;  // of the cameras' time; POSED_SOAK_HOURS=24 is the long run of docs/cameras-v4l2.md

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kOwnAllocator = true;  // a sanitizer's, which keeps what is freed
#else
constexpr bool kOwnAllocator = false;
#endif

double hours() {
  const char* asked = std::getenv("POSED_SOAK_HOURS");
  return asked == nullptr ? kHours : std::atof(asked);
}

std::size_t resident_bytes() {
  std::size_t total = 0;
  std::size_t resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

struct Usage {
  std::size_t resident = 0;
  std::size_t heap = 0;
};

Usage usage() {
  return {resident_bytes(), ::mallinfo2().uordblks};
}

/// All faults that the other tests show one by one, by chance, for as long as one likes.
class V4l2Soak : public testing::Test, public V4l2Rig {
 protected:
  V4l2Soak() : pool_(kRigWidth, kRigHeight, 4), source_(source(pool_)) {
    for (FakeCamera* camera : {color_, depth_}) {
      const std::uint64_t salt = camera == color_ ? 0 : 1;
      camera->fate = [salt](std::uint64_t sequence) {
        const std::uint64_t chance = (sequence * 2 + salt) * 0x9e3779b97f4a7c15ULL >> 44;
        return FakeImage{.dropped = chance % 997 == 1,
                         .damaged = chance % 1999 == 2,
                         .filled = chance % 2003 == 3 ? 0.5 : 1.0,
                         .stamp_shift_ns = chance % 5003 == 4 ? -200 * kNsPerMs : 0,
                         .delay_ns = static_cast<TimeNs>(chance % 8) * kNsPerMs};
      };
    }
  }

  /// One of the larger faults; returns when it is over.
  TimeNs harm() {
    const char* path = random_() % 2 == 0 ? kColorPath : kDepthPath;
    const TimeNs back_ns = clock_.now_ns() + static_cast<TimeNs>(random_() % 4000) * kNsPerMs;
    switch (random_() % 6) {
      case 0: kernel_.silence(path, back_ns); return back_ns;
      case 1: kernel_.break_streaming(path); return clock_.now_ns();
      case 2:
        kernel_.refuse(path, VIDIOC_STREAMON, ENOSPC);
        kernel_.refuse(path, VIDIOC_REQBUFS, ENOMEM);
        kernel_.break_streaming(path);
        return clock_.now_ns();
      default:
        kernel_.unplug(path);
        clock_.at(back_ns, [this, path] { kernel_.replug(path); });
        return back_ns;
    }
  }

  FramePool pool_;
  std::unique_ptr<RgbdSource> source_;
  std::mt19937_64 random_{20261};
};

TEST_F(V4l2Soak, NothingGrowsAndStampsIncrease) {
  const TimeNs begin_ns = clock_.now_ns();
  const TimeNs end_ns = begin_ns + from_seconds(3600 * hours());
  const TimeNs warm_ns = begin_ns + (end_ns - begin_ns) / 10;
  TimeNs next_harm_ns = begin_ns + 10 * kNsPerSecond;
  TimeNs healthy_since_ns = begin_ns;
  TimeNs last_ns = 0;
  TimeNs longest_wait_ns = 0;
  bool waits = true;
  std::uint64_t frames = 0;
  std::uint64_t skipped = 0;
  std::uint64_t faults = 0;
  Usage before;
  while (clock_.now_ns() < end_ns) {
    if (before.resident == 0 && clock_.now_ns() >= warm_ns) {
      before = usage();
    }
    if (clock_.now_ns() >= next_harm_ns) {
      healthy_since_ns = harm();
      waits = true;
      ++faults;
      next_harm_ns = healthy_since_ns + static_cast<TimeNs>(60 + random_() % 60) * kNsPerSecond;
    }
    const Capture got = source_->next({});
    skipped += got.kind == CaptureKind::SkippedFrame ? 1 : 0;
    if (got.kind == CaptureKind::Frame) {
      ++frames;
      ASSERT_GT(got.frame->capture_ns, last_ns);
      last_ns = got.frame->capture_ns;
      if (waits && clock_.now_ns() > healthy_since_ns) {
        longest_wait_ns = std::max(longest_wait_ns, clock_.now_ns() - healthy_since_ns);
        waits = false;
      }
    }
    ASSERT_LE(kernel_.open_descriptors(), 2U);
    ASSERT_LE(kernel_.mappings(), 8U);
  }
  const Usage after = usage();
  const SourceHealth health = source_->health();
  fmt::print(
      "{:.2f} h of camera time, {} frames, {} skipped, {} faults, {} reconnects, longest wait {:.2f} s\n"
      "resident {} -> {} KiB, heap {} -> {} KiB\n",
      hours(), frames, skipped, faults, health.reconnects, to_seconds(longest_wait_ns), before.resident / 1024,
      after.resident / 1024, before.heap / 1024, after.heap / 1024);
  EXPECT_GT(static_cast<double>(frames), 0.9 * 30 * 3600 * hours());
  EXPECT_GT(health.reconnects, faults / 2);
  EXPECT_LT(longest_wait_ns, 2 * kNsPerSecond);
  EXPECT_THAT(kernel_.violations(), testing::IsEmpty());
  if (!kOwnAllocator) {
    EXPECT_LE(after.resident, before.resident + (std::size_t{512} << 10));
    EXPECT_LE(after.heap, before.heap + (std::size_t{64} << 10));
  }
  source_.reset();
  EXPECT_EQ(kernel_.open_descriptors(), 0U);
  EXPECT_EQ(kernel_.mappings(), 0U);
}

}  // namespace
}  // namespace posed::test
