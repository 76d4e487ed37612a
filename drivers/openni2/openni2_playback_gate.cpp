#include "drivers/openni2/openni2_playback_gate.h"

#include <cstdlib>

namespace posed {

void OpenNi2PlaybackGate::taken() {
  {
    MutexLock lock(mutex_);
    waiting_to_be_taken_ = false;
  }
  changed_.notify_all();
}

void OpenNi2PlaybackGate::open() {
  {
    MutexLock lock(mutex_);
    open_ = true;
  }
  changed_.notify_all();
}

void OpenNi2PlaybackGate::close() {
  MutexLock lock(mutex_);
  waiting_to_be_taken_ = false;
  open_ = false;
}

void* OpenNi2PlaybackGate::allocateFrameBuffer(int bytes) {
  {
    MutexLock lock(mutex_);
    while (waiting_to_be_taken_ && !open_) {
      changed_.wait(mutex_);
    }
    waiting_to_be_taken_ = true;
  }
  return std::malloc(static_cast<std::size_t>(bytes));  // NOLINT(cppcoreguidelines-no-malloc): across a C interface
}

void OpenNi2PlaybackGate::freeFrameBuffer(void* buffer) {
  std::free(buffer);  // NOLINT(cppcoreguidelines-no-malloc)
}

}  // namespace posed
