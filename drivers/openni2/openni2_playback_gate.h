#pragma once

#include <condition_variable>

#include "core/mutex.h"
#include "drivers/openni2/openni2_api.h"

namespace posed {

/// Makes the player of a recording wait with the next image of a stream until the one before it was taken. OpenNI2's own means, a
/// playback that is stepped by waiting for images, may step twice, and a stream keeps but its newest image. Set as the stream's
/// allocator, which the player asks for memory for each image. Thread-safe; must outlive the stream and its images.
class OpenNi2PlaybackGate final : public openni::VideoStream::FrameAllocator {
 public:
  /// The image that was handed out is no longer the stream's.
  void taken();

  /// Nothing waits any more, so that the stream can be stopped; `close` undoes it before the stream is started again.
  void open();
  void close();

 private:
  void* allocateFrameBuffer(int bytes) override;
  void freeFrameBuffer(void* buffer) override;

  Mutex mutex_;
  std::condition_variable_any changed_;
  bool waiting_to_be_taken_ POSED_GUARDED_BY(mutex_) = false;
  bool open_ POSED_GUARDED_BY(mutex_) = false;
};

}  // namespace posed
