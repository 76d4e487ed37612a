#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/rgbd_frame.h"

namespace posed {

class FramePool;

/// Shared, read-only hold on a frame; the slot returns to its pool with the last hold. Copying costs one atomic increment.
/// Distinct `FrameRef`s of one frame may be used from different threads; a single `FrameRef` object is reentrant only.
class FrameRef {
 public:
  FrameRef() = default;
  FrameRef(const FrameRef& other) noexcept;
  FrameRef(FrameRef&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), slot_(other.slot_) {}
  FrameRef& operator=(FrameRef other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(slot_, other.slot_);
    return *this;
  }
  ~FrameRef();

  explicit operator bool() const noexcept { return pool_ != nullptr; }
  const RgbdFrame& operator*() const noexcept;
  const RgbdFrame* operator->() const noexcept { return &**this; }

 private:
  friend class FrameWriter;
  FrameRef(FramePool* pool, std::uint32_t slot) noexcept : pool_(pool), slot_(slot) {}

  FramePool* pool_ = nullptr;
  std::uint32_t slot_ = 0;
};

/// The only hold on a slot that is being filled. Becomes a `FrameRef` by `share()`, after which the frame is immutable; a writer
/// that is destroyed instead gives the slot back. Reentrant.
class FrameWriter {
 public:
  FrameWriter(FrameWriter&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), slot_(other.slot_) {}
  FrameWriter& operator=(FrameWriter&&) = delete;
  ~FrameWriter();

  RgbdFrame& operator*() noexcept;
  RgbdFrame* operator->() noexcept { return &**this; }
  FrameRef share() && noexcept { return FrameRef(std::exchange(pool_, nullptr), slot_); }

 private:
  friend class FramePool;
  FrameWriter(FramePool* pool, std::uint32_t slot) noexcept : pool_(pool), slot_(slot) {}

  FramePool* pool_;
  std::uint32_t slot_;
};

/// A fixed number of frames, allocated (and touched, so that no page fault follows) at construction. Thread-safe and lock-free:
/// any thread may acquire, and any thread may drop the last hold. Must outlive every hold on its slots.
class FramePool {
 public:
  FramePool(int width, int height, std::size_t slots);
  ~FramePool();
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;

  /// A free slot, its metadata and views reset and its pixels left as they were; nothing where all slots are held. Never blocks.
  std::optional<FrameWriter> acquire() noexcept;

  std::size_t slots() const noexcept { return slots_.size(); }
  std::size_t free_slots() const noexcept;  ///< a snapshot, for health reports
  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }

 private:
  friend class FrameRef;
  friend class FrameWriter;

  static constexpr std::size_t kCacheLine = 64;
  struct alignas(kCacheLine) Slot {
    std::atomic<std::uint32_t> holds{0};
    RgbdFrame frame;
  };

  RgbdFrame blank_frame(std::uint32_t slot) const noexcept;
  void hold(std::uint32_t slot) noexcept { slots_[slot].holds.fetch_add(1, std::memory_order_relaxed); }
  void release(std::uint32_t slot) noexcept { slots_[slot].holds.fetch_sub(1, std::memory_order_release); }

  int width_;
  int height_;
  std::size_t depth_row_bytes_;
  std::size_t bgr_row_bytes_;
  std::size_t gray_row_bytes_;
  std::vector<Slot> slots_;
  struct FreeAligned {
    void operator()(std::byte* p) const noexcept;
  };
  std::unique_ptr<std::byte[], FreeAligned> pixels_;
};

inline FrameRef::FrameRef(const FrameRef& other) noexcept : pool_(other.pool_), slot_(other.slot_) {
  if (pool_ != nullptr) {
    pool_->hold(slot_);
  }
}
inline FrameRef::~FrameRef() {
  if (pool_ != nullptr) {
    pool_->release(slot_);
  }
}
inline const RgbdFrame& FrameRef::operator*() const noexcept {
  return pool_->slots_[slot_].frame;
}
inline FrameWriter::~FrameWriter() {
  if (pool_ != nullptr) {
    pool_->release(slot_);
  }
}
inline RgbdFrame& FrameWriter::operator*() noexcept {
  return pool_->slots_[slot_].frame;
}

}  // namespace posed
