#include "core/frame_pool.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <new>

namespace posed {

namespace {

constexpr std::size_t kRowAlignment = 64;

std::size_t aligned(std::size_t bytes) { return (bytes + kRowAlignment - 1) / kRowAlignment * kRowAlignment; }

}  // namespace

void FramePool::FreeAligned::operator()(std::byte* p) const noexcept {
  ::operator delete[](p, std::align_val_t{kRowAlignment});
}

FramePool::FramePool(int width, int height, std::size_t slots) : width_(width), height_(height), slots_(slots) {
  assert(width > 0 && height > 0 && slots > 0);
  const auto w = static_cast<std::size_t>(width);
  const auto h = static_cast<std::size_t>(height);
  const std::size_t bgr_row = aligned(3 * w);
  const std::size_t gray_row = aligned(w);
  const std::size_t depth_row = aligned(sizeof(float) * w);
  const std::size_t slot_bytes = h * (bgr_row + gray_row + depth_row);
  // One more row's alignment at the end, so that vector loads may run past the last pixel of the last slot.
  const std::size_t total = slots * slot_bytes + kRowAlignment;
  pixels_.reset(new (std::align_val_t{kRowAlignment}) std::byte[total]);
  std::memset(pixels_.get(), 0, total);

  for (std::size_t i = 0; i < slots; ++i) {
    std::byte* base = pixels_.get() + i * slot_bytes;
    RgbdFrame& frame = slots_[i].frame;
    frame.depth_m = {reinterpret_cast<float*>(base), width, height, static_cast<std::ptrdiff_t>(depth_row / sizeof(float)), 1};
    base += h * depth_row;
    frame.bgr = {reinterpret_cast<std::uint8_t*>(base), width, height, static_cast<std::ptrdiff_t>(bgr_row), 3};
    base += h * bgr_row;
    frame.gray = {reinterpret_cast<std::uint8_t*>(base), width, height, static_cast<std::ptrdiff_t>(gray_row), 1};
  }
}

FramePool::~FramePool() { assert(free_slots() == slots() && "a frame is still held while its pool is destroyed"); }

std::optional<FrameWriter> FramePool::acquire() noexcept {
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    std::uint32_t expected = 0;
    // acquire pairs with the release of the last hold: whoever read the old pixels has finished before we overwrite them.
    if (slots_[i].holds.compare_exchange_strong(expected, 1, std::memory_order_acquire, std::memory_order_relaxed)) {
      RgbdFrame& frame = slots_[i].frame;
      frame.sequence = 0;
      frame.capture_ns = 0;
      frame.stamp_utc_ns = 0;
      frame.T_world_camera_truth.reset();
      return FrameWriter(this, i);
    }
  }
  return std::nullopt;
}

std::size_t FramePool::free_slots() const noexcept {
  return static_cast<std::size_t>(std::count_if(slots_.begin(), slots_.end(), [](const Slot& slot) {
    return slot.holds.load(std::memory_order_relaxed) == 0;
  }));
}

}  // namespace posed
