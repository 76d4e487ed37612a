#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <sys/eventfd.h>

#include "core/clock.h"
#include "core/file_descriptor.h"
#include "core/mutex.h"
#include "drivers/gpio/line_access.h"

namespace posed {

/// A GPIO chip in memory that records what is done to it and does what a test says. Thread-safe. Outlives the lines' owner.
class FakeChip {
 public:
  struct Edge {
    TimeNs at_ns;
    bool active;
    bool operator==(const Edge&) const = default;
  };

  explicit FakeChip(const Clock& clock) : clock_(clock) {}

  std::unique_ptr<LineAccess> access();

  void set_present(bool present) {
    const MutexLock lock(mutex_);
    present_ = present;
  }
  void set_taken(int line, bool taken) {
    const MutexLock lock(mutex_);
    taken ? (void)taken_.insert(line) : (void)taken_.erase(line);
  }
  void set_tells_events(bool tells) {
    const MutexLock lock(mutex_);
    tells_events_ = tells;
  }
  /// Sets an input; the kernel tells of a change, if it tells at all.
  void set_input(int line, bool active) {
    const MutexLock lock(mutex_);
    if (std::exchange(levels_[line], active) != active) {
      ++events_[line];
      eventfd_write(event_fd_.get(), 1);
    }
  }
  /// Sets an input without telling: an event that was lost.
  void set_input_silently(int line, bool active) {
    const MutexLock lock(mutex_);
    levels_[line] = active;
  }
  bool level(int line) const {
    const MutexLock lock(mutex_);
    const auto found = levels_.find(line);
    return found != levels_.end() && found->second;
  }
  /// Changes of an output, those that a request made included.
  std::vector<Edge> edges(int line) const {
    const MutexLock lock(mutex_);
    const auto found = edges_.find(line);
    return found == edges_.end() ? std::vector<Edge>{} : found->second;
  }
  std::vector<TimeNs> requests() const {
    const MutexLock lock(mutex_);
    return requests_;
  }
  int lines_held() const {
    const MutexLock lock(mutex_);
    return lines_held_;
  }
  int writes() const {
    const MutexLock lock(mutex_);
    return writes_;
  }

 private:
  class Line;
  class Access;

  Status check() const POSED_REQUIRES(mutex_) { return present_ ? Status{} : make_error(ErrorCode::NotFound, "the chip is away"); }
  void write(int line, bool active) POSED_REQUIRES(mutex_) {
    ++writes_;
    if (std::exchange(levels_[line], active) != active) {
      edges_[line].push_back({clock_.now_ns(), active});
    }
  }

  const Clock& clock_;
  FileDescriptor event_fd_{eventfd(0, EFD_NONBLOCK)};
  mutable Mutex mutex_;
  bool present_ POSED_GUARDED_BY(mutex_) = true;
  bool tells_events_ POSED_GUARDED_BY(mutex_) = true;
  std::set<int> taken_ POSED_GUARDED_BY(mutex_);
  std::map<int, bool> levels_ POSED_GUARDED_BY(mutex_);
  std::map<int, int> events_ POSED_GUARDED_BY(mutex_);
  std::map<int, std::vector<Edge>> edges_ POSED_GUARDED_BY(mutex_);
  std::vector<TimeNs> requests_ POSED_GUARDED_BY(mutex_);
  int lines_held_ POSED_GUARDED_BY(mutex_) = 0;
  int writes_ POSED_GUARDED_BY(mutex_) = 0;
};

class FakeChip::Line final : public GpioLine {
 public:
  Line(FakeChip& chip, int offset) : chip_(chip), offset_(offset) {}
  ~Line() override {
    const MutexLock lock(chip_.mutex_);
    --chip_.lines_held_;
  }
  Result<bool> is_active() override {
    const MutexLock lock(chip_.mutex_);
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    return chip_.levels_[offset_];
  }
  Status set_active(bool active) override {
    const MutexLock lock(chip_.mutex_);
    const Status present = chip_.check();
    if (present) {
      chip_.write(offset_, active);
    }
    return present;
  }
  int event_fd() const override {
    const MutexLock lock(chip_.mutex_);
    return chip_.tells_events_ ? chip_.event_fd_.get() : -1;
  }
  Result<bool> take_events() override {
    const MutexLock lock(chip_.mutex_);
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    eventfd_t count = 0;
    eventfd_read(chip_.event_fd_.get(), &count);
    return std::exchange(chip_.events_[offset_], 0) > 0 && chip_.tells_events_;
  }

 private:
  FakeChip& chip_;
  int offset_;
};

class FakeChip::Access final : public LineAccess {
 public:
  explicit Access(FakeChip& chip) : chip_(chip) {}
  Result<std::unique_ptr<GpioLine>> request(const LineRequest& request) override {
    const MutexLock lock(chip_.mutex_);
    chip_.requests_.push_back(chip_.clock_.now_ns());
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    if (chip_.taken_.contains(request.offset)) {
      return make_error(ErrorCode::Unavailable, "line " + std::to_string(request.offset) + " is taken");
    }
    if (request.direction == LineDirection::Output) {
      chip_.write(request.offset, false);
    }
    ++chip_.lines_held_;
    return std::make_unique<Line>(chip_, request.offset);
  }

 private:
  FakeChip& chip_;
};

inline std::unique_ptr<LineAccess> FakeChip::access() {
  return std::make_unique<Access>(*this);
}

}  // namespace posed
