#include "core/frame_pool.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(FramePool, HasTheSizeItWasMadeWith) {
  const FramePool pool(33, 7, 3);
  EXPECT_EQ(pool.width(), 33);
  EXPECT_EQ(pool.height(), 7);
  EXPECT_EQ(pool.slots(), 3u);
  EXPECT_EQ(pool.free_slots(), 3u);
}

TEST(FramePool, AWriterThatIsDroppedGivesItsSlotBack) {
  FramePool pool(8, 8, 1);
  {
    const std::optional<FrameWriter> writer = pool.acquire();
    ASSERT_TRUE(writer);
    EXPECT_EQ(pool.free_slots(), 0u);
  }
  EXPECT_EQ(pool.free_slots(), 1u);
}

TEST(FramePool, ASlotReturnsWithItsLastHold) {
  FramePool pool(8, 8, 1);
  FrameRef first = std::move(*pool.acquire()).share();
  FrameRef second = first;
  EXPECT_TRUE(first);
  first = FrameRef();
  EXPECT_FALSE(first);
  EXPECT_EQ(pool.free_slots(), 0u);
  second = FrameRef();
  EXPECT_EQ(pool.free_slots(), 1u);
}

TEST(FramePool, MovesAndSelfAssignmentNeitherAddNorLoseAHold) {
  FramePool pool(8, 8, 2);
  FrameRef a = std::move(*pool.acquire()).share();
  FrameRef b = std::move(a);
  EXPECT_FALSE(a);  // NOLINT(bugprone-use-after-move): a moved-from reference holds nothing, and that is what is tested
  EXPECT_TRUE(b);
  const FrameRef& alias = b;
  b = alias;
  EXPECT_TRUE(b);
  EXPECT_EQ(pool.free_slots(), 1u);

  FrameRef c = std::move(*pool.acquire()).share();
  EXPECT_EQ(pool.free_slots(), 0u);
  c = b;  // drops c's own slot
  EXPECT_EQ(pool.free_slots(), 1u);
  b = FrameRef();
  EXPECT_EQ(pool.free_slots(), 1u);
  c = FrameRef();
  EXPECT_EQ(pool.free_slots(), 2u);
}

TEST(FramePool, RefusesWhileAllSlotsAreHeldAndServesAgainAfterwards) {
  FramePool pool(8, 8, 3);
  std::vector<FrameRef> held;
  for (int i = 0; i < 3; ++i) {
    held.push_back(std::move(*pool.acquire()).share());
  }
  EXPECT_FALSE(pool.acquire());
  held.erase(held.begin() + 1);
  EXPECT_TRUE(pool.acquire());
  EXPECT_EQ(pool.free_slots(), 1u);
}

TEST(FramePool, FramesCarryTheirPixelsAndMetadataToEveryHold) {
  FramePool pool(4, 2, 1);
  std::optional<FrameWriter> writer = pool.acquire();
  (*writer)->sequence = 42;
  (*writer)->depth_m.at(3, 1) = 1.5f;
  const FrameRef frame = std::move(*writer).share();
  const FrameRef copy = frame;
  EXPECT_EQ(copy->sequence, 42u);
  EXPECT_EQ((*copy).depth_m.at(3, 1), 1.5f);
  EXPECT_EQ(copy->depth_m.data, frame->depth_m.data);
}

TEST(FramePool, AReusedSlotStartsBlankButForItsPixels) {
  FramePool pool(4, 2, 1);
  const float* depth = nullptr;
  {
    std::optional<FrameWriter> writer = pool.acquire();
    RgbdFrame& frame = **writer;
    depth = frame.depth_m.data;
    frame.sequence = 7;
    frame.capture_ns = 8;
    frame.stamp_utc_ns = 9;
    frame.T_world_camera_truth = Se3();
    frame.depth_m.at(0, 0) = 2.0f;
    frame.gray = {};  // a source that mislaid a view must not spoil the frames after it
  }
  std::optional<FrameWriter> again = pool.acquire();
  ASSERT_TRUE(again);
  const RgbdFrame& frame = **again;
  EXPECT_EQ(frame.sequence, 0u);
  EXPECT_EQ(frame.capture_ns, 0);
  EXPECT_EQ(frame.stamp_utc_ns, 0);
  EXPECT_FALSE(frame.T_world_camera_truth);
  EXPECT_EQ(frame.depth_m.data, depth);
  EXPECT_EQ(frame.depth_m.at(0, 0), 2.0f);
  EXPECT_EQ(frame.gray.width, 4);
  EXPECT_FALSE(frame.gray.empty());
}

TEST(FramePool, RowsStartOnCacheLinesAndNoTwoImagesOverlap) {
  constexpr int kWidth = 37;  // no row of any of the images is a whole number of cache lines
  constexpr int kHeight = 5;
  FramePool pool(kWidth, kHeight, 3);
  std::vector<FrameWriter> writers;
  for (std::uint8_t i = 0; i < 3; ++i) {
    writers.push_back(std::move(*pool.acquire()));
    RgbdFrame& frame = *writers.back();
    EXPECT_EQ(frame.bgr.channels, 3);
    EXPECT_EQ(frame.gray.channels, 1);
    for (int y = 0; y < kHeight; ++y) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(frame.bgr.row(y)) % 64, 0u);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(frame.gray.row(y)) % 64, 0u);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(frame.depth_m.row(y)) % 64, 0u);
      // Up to the stride: readers may load whole vectors.
      std::memset(frame.bgr.row(y), 10 + i, static_cast<std::size_t>(frame.bgr.stride));
      std::memset(frame.gray.row(y), 20 + i, static_cast<std::size_t>(frame.gray.stride));
      std::fill_n(frame.depth_m.row(y), frame.depth_m.stride, 30.0f + i);
    }
  }
  for (std::uint8_t i = 0; i < 3; ++i) {
    const RgbdFrame& frame = *writers[i];
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(frame.bgr.at(x, y), 10 + i);
        ASSERT_EQ(frame.gray.at(x, y), 20 + i);
        ASSERT_EQ(frame.depth_m.at(x, y), 30.0f + i);
      }
    }
  }
}

#ifndef NDEBUG
TEST(FramePoolDeathTest, MustOutliveItsFrames) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(
      {
        FrameRef outlives;
        FramePool pool(8, 8, 1);
        outlives = std::move(*pool.acquire()).share();
      },
      "a frame is still held");
}
#endif

}  // namespace
}  // namespace posed
