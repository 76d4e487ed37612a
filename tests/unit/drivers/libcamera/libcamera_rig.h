#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include <poll.h>
#include <span>
#include <utility>
#include <vector>

#include "config/config.h"
#include "core/frame_pool.h"
#include "drivers/camera_source.h"
#include "drivers/libcamera/libcamera_camera.h"
#include "tests/support/fake_v4l2.h"
#include "tests/support/scripted_clock.h"
#include "tests/unit/drivers/libcamera/fake_color_camera.h"

namespace posed::test {

/// The kernel of the depth camera, but for the waiting.
class ForwardingSystem : public V4l2System {
 public:
  explicit ForwardingSystem(FakeKernel& kernel) : kernel_(kernel) {}

  int open(const char* path) override { return kernel_.open(path); }
  int close(int descriptor) override { return kernel_.close(descriptor); }
  int ioctl(int descriptor, unsigned long request, void* argument) override { return kernel_.ioctl(descriptor, request, argument); }
  int map(int descriptor, std::size_t length, std::uint32_t offset, void** address) override {
    return kernel_.map(descriptor, length, offset, address);
  }
  int unmap(void* address, std::size_t length) override { return kernel_.unmap(address, length); }

 protected:
  FakeKernel& kernel_;
};

/// Lets the colour camera complete its images while somebody waits.
class RigSystem final : public ForwardingSystem {
 public:
  RigSystem(FakeKernel& kernel, FakeColorCamera& color, const Clock& clock)
      : ForwardingSystem(kernel), color_(color), clock_(clock) {}

  int poll(std::span<pollfd> waited, TimeNs timeout_ns) override {
    const TimeNs deadline_ns = clock_.now_ns() + std::max<TimeNs>(0, timeout_ns);
    while (true) {
      color_.run();
      const int completed = ::poll(&waited[0], 1, 0);
      const TimeNs until_ns = completed > 0 ? clock_.now_ns() : std::min(deadline_ns, color_.next_ns());
      const int ready = kernel_.poll(waited.subspan(1), until_ns - clock_.now_ns());
      if (ready < 0 || completed + ready > 0 || clock_.now_ns() >= deadline_ns) {
        return ready < 0 ? ready : completed + ready;
      }
    }
  }

 private:
  FakeColorCamera& color_;
  const Clock& clock_;
};

/// A colour camera behind libcamera's seam and a depth camera behind the kernel's, both with tiny images at 30 Hz.
struct LibcameraRig {
  static constexpr int kWidth = 16;
  static constexpr int kHeight = 8;
  static constexpr const char* kDepth = "/dev/video2";

  LibcameraRig() {
    FakeCamera camera;
    camera.formats = {{V4L2_PIX_FMT_Z16, {{kWidth, kHeight}}}};
    camera.paint = [](std::uint64_t sequence, const v4l2_pix_format&, std::vector<std::uint8_t>& image) {
      const auto value = static_cast<std::uint16_t>(1000 + sequence);
      for (std::size_t i = 0; i + 1 < image.size(); i += 2) {
        std::memcpy(&image[i], &value, sizeof value);
      }
    };
    depth = &kernel.plug(kDepth, std::move(camera));
    config.depth.node.device = kDepth;
    intrinsics.width = kWidth;
    intrinsics.height = kHeight;
    intrinsics.depth_units_per_metre = 1000.0;
  }

  std::unique_ptr<LibcameraCamera> camera() {
    return std::make_unique<LibcameraCamera>(color.handle(), system, config, intrinsics, clock);
  }

  /// Reads until something else than nothing comes, for at most `for_ns`.
  CameraRead read(LibcameraCamera& from, RgbdFrame* frame, TimeNs for_ns = 10 * kNsPerSecond) {
    CameraRead got;
    for (const TimeNs end_ns = clock.now_ns() + for_ns; got.kind == CameraReadKind::Nothing && clock.now_ns() < end_ns;) {
      got = from.read(frame, 20 * kNsPerMs);
    }
    return got;
  }

  ScriptedClock clock;
  FakeKernel kernel{clock};
  FakeColorCamera color{clock, kWidth, kHeight};
  RigSystem system{kernel, color, clock};
  FakeCamera* depth = nullptr;
  SourceConfig config;
  CameraIntrinsics intrinsics;
};

}  // namespace posed::test
