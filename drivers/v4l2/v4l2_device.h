#pragma once

#include <string>
#include <string_view>

#include <linux/videodev2.h>

#include "core/result.h"
#include "drivers/v4l2/v4l2_system.h"

namespace posed {

/// One V4L2 node, open or not. Closes itself. Thread-bound.
class V4l2Device {
 public:
  V4l2Device(V4l2System& system, std::string path) : system_(system), path_(std::move(path)) {}
  ~V4l2Device() { close(); }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// NotFound where there is no such node, Io where it cannot be opened.
  Status open();
  void close() noexcept;

  const std::string& path() const { return path_; }
  int descriptor() const { return descriptor_; }  ///< -1 where it is closed
  V4l2System& system() const { return system_; }

  int ioctl(unsigned long request, void* argument) const { return system_.ioctl(descriptor_, request, argument); }

  /// The error for people and for CameraSource: "/dev/video0: STREAMON: Device or resource busy (another program ...)".
  tl::unexpected<Error> failure(std::string_view action, int negative_errno) const;
  tl::unexpected<Error> unsupported(std::string_view message) const;

  /// What the node itself can do. Unsupported where it is no V4L2 node.
  Result<v4l2_capability> capability() const;

 private:
  V4l2System& system_;
  std::string path_;
  int descriptor_ = -1;
};

/// Of the node, not of the whole device.
std::uint32_t capabilities_of(const v4l2_capability& capability);

}  // namespace posed
