#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "tests/unit/drivers/libcamera/libcamera_rig.h"

namespace posed::test {
namespace {

constexpr int kWidth = LibcameraRig::kWidth;
constexpr int kHeight = LibcameraRig::kHeight;

/// A colour camera that completes its images on a thread of its own, as libcamera does.
class ThreadedColorCamera final : public ColorCamera {
 public:
  ~ThreadedColorCamera() override { ThreadedColorCamera::close(); }

  const std::string& description() const override { return description_; }

  Status open(CompletionSink& sink) override {
    for (std::atomic<bool>& queued : queued_) {
      queued = true;
    }
    thread_ = std::jthread([this, &sink](const std::stop_token& stop) { run(stop, sink); });
    return {};
  }

  void close() noexcept override {
    thread_.request_stop();
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  const ColorFormat& format() const override { return format_; }
  TimeNs period_ns() const override { return 5 * kNsPerMs; }
  std::size_t buffers() const override { return memory_.size(); }
  ColorPlanes planes(std::uint32_t buffer) const override { return {memory_[buffer], {}}; }

  Status give_back(std::uint32_t buffer) override {
    queued_[buffer].store(true, std::memory_order_release);
    return {};
  }

 private:
  void run(const std::stop_token& stop, CompletionSink& sink) {
    for (std::uint64_t sequence = 0; !stop.stop_requested(); ++sequence) {
      const auto buffer = static_cast<std::uint32_t>(sequence % memory_.size());
      if (queued_[buffer].exchange(false, std::memory_order_acquire)) {
        memory_[buffer].fill(static_cast<std::uint8_t>(sequence));
        const TimeNs now_ns = SystemClock::instance().now_ns();
        sink.on_completed({CompletedImage::Kind::Filled, buffer, sequence, now_ns, now_ns, memory_[buffer].size()});
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    for (std::uint32_t buffer = 0; buffer < memory_.size(); ++buffer) {
      sink.on_completed({.kind = CompletedImage::Kind::Cancelled, .buffer = buffer});
    }
  }

  std::string description_ = "threaded colour camera";
  ColorFormat format_{ColorLayout::Bgr, kWidth, kHeight, 3 * kWidth, {}};
  std::array<std::array<std::uint8_t, 3 * kWidth * kHeight>, 4> memory_{};
  std::array<std::atomic<bool>, 4> queued_{};
  std::jthread thread_;
};

/// Waits in real time for the wake-up of a real thread and for the depth camera of the tests' kernel.
class RealTimeSystem final : public ForwardingSystem {
 public:
  using ForwardingSystem::ForwardingSystem;

  int poll(std::span<pollfd> waited, TimeNs timeout_ns) override {
    const SystemClock& clock = SystemClock::instance();
    for (const TimeNs deadline_ns = clock.now_ns() + timeout_ns;;) {
      const int completed = ::poll(&waited[0], 1, 0);
      const int ready = kernel_.poll(waited.subspan(1), completed > 0 ? 0 : kNsPerMs);
      if (ready < 0 || completed + ready > 0 || clock.now_ns() >= deadline_ns) {
        return ready < 0 ? ready : completed + ready;
      }
    }
  }
};

TEST(LibcameraThread, ImagesCrossFromLibcamerasThreadWhole) {
  LibcameraRig rig;  // for its configuration and its depth camera's settings
  FakeKernel kernel(SystemClock::instance());
  rig.depth->rate_hz = 200;
  kernel.plug(LibcameraRig::kDepth, *rig.depth);
  RealTimeSystem system(kernel);
  LibcameraCamera camera(std::make_unique<ThreadedColorCamera>(), system, rig.config, rig.intrinsics, SystemClock::instance());
  FramePool pool(kWidth, kHeight, 1);
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(camera.open());
    for (int frames = 0; frames < 40;) {
      FrameWriter frame = *pool.acquire();
      const CameraRead got = camera.read(&*frame, 20 * kNsPerMs);
      ASSERT_TRUE(got.kind == CameraReadKind::Frame || got.kind == CameraReadKind::Nothing) << got.error.message;
      if (got.kind == CameraReadKind::Frame) {
        ++frames;
        const auto value = static_cast<std::uint8_t>(frame->bgr.row(0)[0]);
        for (int y = 0; y < kHeight; ++y) {
          ASSERT_TRUE(std::all_of(frame->bgr.row(y), frame->bgr.row(y) + 3 * kWidth, [&](std::uint8_t v) { return v == value; }));
        }
      }
    }
    camera.close();
  }
  EXPECT_TRUE(kernel.violations().empty());
}

}  // namespace
}  // namespace posed::test
