#include "tests/unit/drivers/openni2/openni2_rig.h"

#include <condition_variable>
#include <dlfcn.h>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include "drivers/openni2/openni2_source.h"

// What OpenNI2 itself loses: 9 kB each time that it is initialised, 1.3 kB each time that a camera is plugged in.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier): the leak sanitizer's name
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOpenNI2.so\nleak:libOniFile.so\n";
}

namespace posed::test {

using namespace std::chrono_literals;

namespace {

/// A library that is never closed, and so outlives OpenNI2's own loading and unloading of it.
void* keep_open(const char* name) {
  void* const library = dlopen((std::string(FAKE_OPENNI2_DRIVERS "/") + name).c_str(), RTLD_NOW);
  if (library == nullptr) {
    throw std::runtime_error(dlerror());
  }
  return library;
}

}  // namespace

FakeOpenNi2& fake_openni2() {
  static FakeOpenNi2* const fake = [] {
    keep_open("libOniFile.so.0");  // else the leak sanitizer could not name it
    return reinterpret_cast<FakeOpenNi2Function*>(dlsym(keep_open("libFakeCamera.so.0"), "fake_openni2"))();
  }();
  return *fake;
}

FakeOpenNi2Camera fake_camera() {
  FakeOpenNi2Camera camera;
  camera.color_modes = {fake_mode(ONI_PIXEL_FORMAT_RGB888)};
  camera.depth_modes = {fake_mode(ONI_PIXEL_FORMAT_DEPTH_1_MM)};
  return camera;
}

OniVideoMode fake_mode(OniPixelFormat format, int width, int height, int fps) {
  return {format, width, height, fps};
}

SourceConfig openni2_config() {
  SourceConfig config;
  config.kind = SourceKind::OpenNi2;
  return config;
}

CameraIntrinsics small_camera() {
  CameraIntrinsics camera;
  camera.width = kWidth;
  camera.height = kHeight;
  return camera;
}

std::uint8_t test_color(int x, int y, int channel, int index) {
  return static_cast<std::uint8_t>(7 * x + 13 * y + 71 * channel + 31 * index);
}

std::uint16_t test_depth(int x, int y, int index) {
  return x == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(500 + 11 * x + 17 * y + 29 * (index % 100));
}

std::vector<std::uint8_t> rgb_image(int index) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        pixels.push_back(test_color(x, y, channel, index));
      }
    }
  }
  return pixels;
}

std::vector<std::uint16_t> depth_image(int index) {
  std::vector<std::uint16_t> pixels;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      pixels.push_back(test_depth(x, y, index));
    }
  }
  return pixels;
}

bool push_color(std::uint64_t timestamp_us, int index, const std::string& uri) {
  const std::vector<std::uint8_t> pixels = rgb_image(index);
  return fake_openni2().push(uri, ONI_SENSOR_COLOR,
                             {pixels.data(), static_cast<int>(pixels.size()), 3 * kWidth, kWidth, kHeight, timestamp_us, index});
}

bool push_depth(std::uint64_t timestamp_us, int index, const std::string& uri) {
  const std::vector<std::uint16_t> pixels = depth_image(index);
  return fake_openni2().push(
      uri, ONI_SENSOR_DEPTH,
      {pixels.data(), static_cast<int>(2 * pixels.size()), 2 * kWidth, kWidth, kHeight, timestamp_us, index});
}

bool push_pair(std::uint64_t timestamp_us, int index, const std::string& uri) {
  const bool color = push_color(timestamp_us, index, uri);
  return push_depth(timestamp_us, index, uri) && color;
}

testing::AssertionResult shows(const RgbdFrame& frame, int index) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::uint8_t* bgr = &frame.bgr.at(x, y);
      const int r = test_color(x, y, 0, index);
      const int g = test_color(x, y, 1, index);
      const int b = test_color(x, y, 2, index);
      const float depth_m = static_cast<float>(test_depth(x, y, index)) / 1000.0F;
      const int gray = (4899 * r + 9617 * g + 1868 * b + 8192) >> 14;
      if (bgr[0] != b || bgr[1] != g || bgr[2] != r || frame.gray.at(x, y) != gray || frame.depth_m.at(x, y) != depth_m) {
        return testing::AssertionFailure() << "pixel " << x << ", " << y << " of image " << index << ": BGR " << int{bgr[0]} << " "
                                           << int{bgr[1]} << " " << int{bgr[2]} << ", grey " << int{frame.gray.at(x, y)}
                                           << ", depth " << frame.depth_m.at(x, y);
      }
    }
  }
  return testing::AssertionSuccess();
}

Running::Running(const SourceConfig& config, const Clock& clock, std::size_t slots) {
  const CameraIntrinsics camera = small_camera();
  Result<std::unique_ptr<RgbdSource>> made = make_rgbd_source(config, camera, clock);
  if (!made) {
    throw std::runtime_error(made.error().message);
  }
  source_ = *std::move(made);
  pool_ = std::make_unique<FramePool>(camera.width, camera.height, slots);
  if (Status started = source_->start(*pool_); !started) {
    throw std::runtime_error(started.error().message);
  }
}

Capture Running::next(std::chrono::milliseconds at_most) {
  std::stop_source stop;
  std::jthread timer([&](const std::stop_token& done) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, done, at_most, [] { return false; });
    stop.request_stop();
  });
  return source_->next(stop.get_token());
}

Capture Running::open(const std::string& uri) {
  for (int tries = 0; tries < 200; ++tries) {
    Capture capture = next(50ms);
    if (capture.kind != CaptureKind::Stopped) {
      return capture;
    }
    const FakeOpenNi2State state = fake_openni2().state(uri);
    if (state.color_runs && state.depth_runs) {
      return capture;
    }
  }
  throw std::runtime_error("the fake camera was not opened");
}

}  // namespace posed::test
