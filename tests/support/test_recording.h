#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <stdlib.h>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/frame_pool.h"
#include "drivers/tum_writer.h"
#include "tests/support/temporary_folder.h"

namespace posed {

inline std::vector<std::uint8_t> bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline std::string text_of(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = bytes_of(path);
  return {bytes.begin(), bytes.end()};
}

inline void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// Cuts `path` to its first `bytes` bytes.
inline void truncate_file(const std::filesystem::path& path, std::uintmax_t bytes) {
  std::filesystem::resize_file(path, bytes);
}

/// A clock that stands still but for sleeps, which pass at once. Thread-safe.
class SteppedClock final : public Clock {
 public:
  TimeNs now_ns() const noexcept override { return now_ns_.load(); }
  void sleep_until(TimeNs deadline_ns) const override {
    TimeNs now = now_ns_.load();
    while (now < deadline_ns && !now_ns_.compare_exchange_weak(now, deadline_ns)) {
    }
  }
  std::int64_t utc_ns(TimeNs monotonic_ns) const noexcept override { return monotonic_ns; }
  void advance(TimeNs duration_ns) { now_ns_ += duration_ns; }

 private:
  mutable std::atomic<TimeNs> now_ns_{5 * kNsPerSecond};
};

constexpr int kTestWidth = 48;
constexpr int kTestHeight = 36;
constexpr std::int64_t kTestStampNs = 1'305'031'102'175'304'001;
constexpr std::int64_t kTestPeriodNs = 33'333'333;

/// Smooth colour and whole raw units of depth, so that both formats keep what can be kept; every frame another one.
inline void paint(RgbdFrame& frame, int index) {
  for (int y = 0; y < frame.bgr.height; ++y) {
    for (int x = 0; x < frame.bgr.width; ++x) {
      std::uint8_t* bgr = &frame.bgr.at(x, y);
      bgr[0] = static_cast<std::uint8_t>(4 * x + index);
      bgr[1] = static_cast<std::uint8_t>(5 * y + index);
      bgr[2] = static_cast<std::uint8_t>(2 * x + 3 * y);
      const int raw = (x + y) % 7 == 0 ? 0 : 5000 + 31 * x + 17 * y + index;
      frame.depth_m.at(x, y) = static_cast<float>(raw) / 5000.0F;
    }
  }
}

/// A recording of `frames` frames, kTestPeriodNs apart.
inline void write_recording(const std::filesystem::path& folder, int frames, ColorFormat format = ColorFormat::Png) {
  TumWriterOptions options;
  options.color_format = format;
  Result<TumWriter> writer = TumWriter::create(folder, options);
  FramePool pool(kTestWidth, kTestHeight, 1);
  for (int i = 0; writer && i < frames; ++i) {
    std::optional<FrameWriter> frame = pool.acquire();
    (*frame)->sequence = static_cast<std::uint64_t>(i);
    (*frame)->stamp_utc_ns = kTestStampNs + i * kTestPeriodNs;
    paint(**frame, i);
    if (const Status added = writer->add_frame(**frame); !added) {
      throw std::runtime_error(added.error().message);
    }
  }
  const Status committed = writer ? writer->commit() : Status(tl::unexpected(writer.error()));
  if (!committed) {
    throw std::runtime_error(committed.error().message);
  }
}

}  // namespace posed
