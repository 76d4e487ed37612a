#include "core/frame_pool.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <new>

namespace posed {

namespace {

constexpr std::size_t kRowAlignment = 64;

std::size_t aligned(std::size_t bytes) {
  return (bytes + kRowAlignment - 1) / kRowAlignment * kRowAlignment;
}

}  // namespace

void FramePool::FreeAligned::operator()(std::byte* p) const noexcept {
  ::operator delete[](p, std::align_val_t{kRowAlignment});
}

FramePool::FramePool(int width, int height, std::size_t slots)
    : width_(width),
      height_(height),
      depth_row_bytes_(aligned(sizeof(float) * static_cast<std::size_t>(width))),
      bgr_row_bytes_(aligned(3 * static_cast<std::size_t>(width))),
      gray_row_bytes_(aligned(static_cast<std::size_t>(width))),
      slots_(slots) {
  assert(width > 0 && height > 0 && slots > 0);
  const std::size_t slot_bytes = static_cast<std::size_t>(height) * (depth_row_bytes_ + bgr_row_bytes_ + gray_row_bytes_);
  // A little more at the end, so that vector loads may run past the last pixel of the last slot.
  const std::size_t total = slots * slot_bytes + kRowAlignment;
  pixels_.reset(new (std::align_val_t{kRowAlignment}) std::byte[total]);
  std::memset(pixels_.get(), 0, total);
}

RgbdFrame FramePool::blank_frame(std::uint32_t slot) const noexcept {
  const auto rows = static_cast<std::size_t>(height_);
  std::byte* const depth = pixels_.get() + slot * rows * (depth_row_bytes_ + bgr_row_bytes_ + gray_row_bytes_);
  std::byte* const bgr = depth + rows * depth_row_bytes_;
  std::byte* const gray = bgr + rows * bgr_row_bytes_;
  RgbdFrame frame;
  frame.depth_m = {reinterpret_cast<float*>(depth), width_, height_, static_cast<std::ptrdiff_t>(depth_row_bytes_ / sizeof(float)),
                   1};
  frame.bgr = {reinterpret_cast<std::uint8_t*>(bgr), width_, height_, static_cast<std::ptrdiff_t>(bgr_row_bytes_), 3};
  frame.gray = {reinterpret_cast<std::uint8_t*>(gray), width_, height_, static_cast<std::ptrdiff_t>(gray_row_bytes_), 1};
  return frame;
}

FramePool::~FramePool() {
  assert(free_slots() == slots() && "a frame is still held while its pool is destroyed");
}

std::optional<FrameWriter> FramePool::acquire() noexcept {
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    std::uint32_t expected = 0;
    // acquire pairs with the release of the last hold: whoever read the old pixels has finished before we overwrite them.
    if (slots_[i].holds.compare_exchange_strong(expected, 1, std::memory_order_acquire, std::memory_order_relaxed)) {
      slots_[i].frame = blank_frame(i);
      return FrameWriter(this, i);
    }
  }
  return std::nullopt;
}

std::size_t FramePool::free_slots() const noexcept {
  return static_cast<std::size_t>(std::count_if(slots_.begin(), slots_.end(),
                                                [](const Slot& slot) { return slot.holds.load(std::memory_order_relaxed) == 0; }));
}

}  // namespace posed
