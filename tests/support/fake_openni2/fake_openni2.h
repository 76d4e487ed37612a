#pragma once

#include <OniCTypes.h>
#include <cstdint>
#include <string>
#include <vector>

/// A driver for OpenNI2 without hardware: OpenNI2 loads it as it loads any other, and the test in the same process says what
/// cameras there are, what they refuse, and each image that they deliver.
namespace posed::test {

struct FakeOpenNi2Camera {
  std::string uri = "fake/0";
  std::string serial = "F0001";
  std::vector<OniVideoMode> color_modes;
  std::vector<OniVideoMode> depth_modes;
  bool can_register = true;
  bool can_sync = true;
  bool can_unmirror = true;  ///< it starts mirrored
  bool busy = false;         ///< it cannot be opened
  bool color_starts = true;
  bool depth_starts = true;
  std::vector<int> refused_formats;  ///< offered, but they cannot be set
};

/// What a camera was told last, and how it stands.
struct FakeOpenNi2State {
  int times_opened = 0;
  int times_closed = 0;
  int streams = 0;  ///< that exist
  OniVideoMode color_mode{};
  OniVideoMode depth_mode{};
  bool color_runs = false;
  bool depth_runs = false;
  bool color_mirrored = true;
  bool depth_mirrored = true;
  bool auto_exposure = false;
  bool auto_white_balance = false;
  int registration = -1;    ///< an OniImageRegistrationMode; -1: not told
  int synced_streams = -1;  ///< -1: not told; 0: told to end
};

struct FakeOpenNi2Image {
  const void* data = nullptr;
  int bytes = 0;
  int stride = 0;  ///< bytes
  int width = 0;
  int height = 0;
  std::uint64_t timestamp_us = 0;
  int index = 0;
};

/// Thread-safe. Cameras are named by their URIs.
class FakeOpenNi2 {
 public:
  virtual void reset() = 0;  ///< no camera is there; not while OpenNI2 is initialised
  virtual void plug(const FakeOpenNi2Camera& camera) = 0;
  virtual void change(const FakeOpenNi2Camera& camera) = 0;  ///< of one that is there: what it can do from now on
  virtual void unplug(const std::string& uri) = 0;
  virtual void fail(const std::string& uri) = 0;  ///< it reports its error state
  /// Whether the stream runs; the image is lost otherwise.
  virtual bool push(const std::string& uri, OniSensorType sensor, const FakeOpenNi2Image& image) = 0;
  virtual FakeOpenNi2State state(const std::string& uri) = 0;
  virtual bool initialised() = 0;

 protected:
  ~FakeOpenNi2() = default;
};

/// The driver's symbol `fake_openni2`, a function of this type.
using FakeOpenNi2Function = FakeOpenNi2*();

}  // namespace posed::test
