#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/frame_pool.h"
#include "drivers/rgbd_source.h"
#include "tests/support/fake_openni2/fake_openni2.h"

namespace posed::test {

inline constexpr int kWidth = 64;
inline constexpr int kHeight = 48;

FakeOpenNi2& fake_openni2();

/// 64x48 at 30 Hz, RGB888 and millimetres.
FakeOpenNi2Camera fake_camera();
OniVideoMode fake_mode(OniPixelFormat format, int width = kWidth, int height = kHeight, int fps = 30);

SourceConfig openni2_config();
CameraIntrinsics small_camera();

/// The values of pixels of image number `index`: no two neighbours, rows or images are alike.
std::uint8_t test_color(int x, int y, int channel, int index);
std::uint16_t test_depth(int x, int y, int index);
std::vector<std::uint8_t> rgb_image(int index);
std::vector<std::uint16_t> depth_image(int index);

bool push_color(std::uint64_t timestamp_us, int index, const std::string& uri = "fake/0");
bool push_depth(std::uint64_t timestamp_us, int index, const std::string& uri = "fake/0");
/// Colour and depth of one instant, for a camera in its first modes.
bool push_pair(std::uint64_t timestamp_us, int index, const std::string& uri = "fake/0");

/// Whether the frame holds image `index`, pixel by pixel.
testing::AssertionResult shows(const RgbdFrame& frame, int index);

/// A source with a pool, run by the test's own thread.
class Running {
 public:
  Running(const SourceConfig& config, const Clock& clock, std::size_t slots = 4);

  /// Stopped where nothing came within the time.
  Capture next(std::chrono::milliseconds at_most = std::chrono::seconds(10));
  /// Runs the source until the camera streams; the interruption where it cannot.
  Capture open(const std::string& uri = "fake/0");

  RgbdSource& source() { return *source_; }
  SourceHealth health() const { return source_->health(); }
  FramePool& pool() { return *pool_; }

 private:
  std::unique_ptr<FramePool> pool_;  // outlives the source
  std::unique_ptr<RgbdSource> source_;
};

/// Leaves no camera behind.
class OpenNi2Test : public testing::Test {
 protected:
  OpenNi2Test() { fake_openni2().reset(); }
};

}  // namespace posed::test
