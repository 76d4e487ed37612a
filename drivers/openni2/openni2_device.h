#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include "config/camera_source_config.h"
#include "core/result.h"
#include "drivers/openni2/openni2_api.h"
#include "drivers/openni2/openni2_modes.h"
#include "drivers/openni2/openni2_playback_gate.h"
#include "drivers/openni2/openni2_runtime.h"

namespace posed {

/// An OpenNI2 device with its two streams, set as posed needs them. Thread-bound, but for the constructor.
class OpenNi2Device {
 public:
  enum Kind : std::size_t { Color, Depth, kKinds };

  struct Stream {
    openni::VideoStream stream;
    openni::VideoMode mode;
    bool mirrored = false;  ///< the device mirrors its images and cannot be told not to
    bool started = false;
    OpenNi2PlaybackGate gate;
  };

  /// Initialises OpenNI2, if it can, in the thread that will destroy this (see OpenNi2Runtime).
  OpenNi2Device(const OpenNi2Config& config, const OpenNi2Wish& wish);
  ~OpenNi2Device() { close(); }
  OpenNi2Device(const OpenNi2Device&) = delete;
  OpenNi2Device& operator=(const OpenNi2Device&) = delete;

  /// Finds the device and starts both streams; closes everything again where that fails. Errors as of Camera::open.
  Status open(bool frame_sync);

  /// Ends both streams.
  void stop() noexcept;
  /// Gives everything back; no image of the streams may be held any more.
  void close() noexcept;

  Stream& operator[](Kind kind) { return streams_[kind]; }
  const OpenNi2Watch& watch() const { return *watch_; }  ///< only while it is open

 private:
  Status open_all(bool frame_sync);
  Status start_camera(bool frame_sync);
  Status start_recording();
  Status create(Kind kind);
  Status choose_mode(Kind kind);
  Status take_recorded_mode(Kind kind);
  void unmirror(Stream& stream);
  Status register_depth();
  void set_automatics();
  Status start(Kind kind);

  const OpenNi2Config config_;
  const OpenNi2Wish wish_;
  OpenNi2Runtime runtime_;
  std::unique_ptr<OpenNi2Watch> watch_;
  openni::Device device_;
  std::array<Stream, kKinds> streams_;
  bool synced_ = false;
};

}  // namespace posed
