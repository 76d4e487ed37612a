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

}  // namespace posed
