#include "drivers/openni2/openni2_source.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "drivers/camera_source.h"
#include "drivers/openni2/openni2_camera.h"
#include "drivers/openni2/openni2_devices.h"

namespace posed {

namespace {

constexpr double kNoStall_s = 1e6;

/// The best mode of each size and format.
void add_formats(openni::Device& device, openni::SensorType sensor, const char* name, std::vector<ListedFormat>& formats) {
  if (!device.hasSensor(sensor)) {
    return;
  }
  const openni::Array<openni::VideoMode>& modes = device.getSensorInfo(sensor)->getSupportedVideoModes();
  for (int i = 0; i < modes.getSize(); ++i) {
    const ListedFormat format{name, openni2_format_name(modes[i].getPixelFormat()), modes[i].getResolutionX(),
                              modes[i].getResolutionY(), static_cast<double>(modes[i].getFps())};
    const auto same = std::find_if(formats.begin(), formats.end(), [&](const ListedFormat& other) {
      return other.stream == format.stream && other.format == format.format && other.width == format.width &&
             other.height == format.height;
    });
    if (same == formats.end()) {
      formats.push_back(format);
    } else {
      same->rate_hz = std::max(same->rate_hz, format.rate_hz);
    }
  }
}

ListedCamera list(const OpenNi2Found& found) {
  ListedCamera camera{"openni2", found.uri, fmt::format("{} {}", found.vendor, found.name), {}};
  openni::Device device;
  if (device.open(found.uri.c_str()) != openni::STATUS_OK) {
    return camera;
  }
  if (const std::string serial = openni2_serial(device); !serial.empty()) {
    camera.name += fmt::format(" ({}{})", kOpenNi2Serial, serial);
  }
  add_formats(device, openni::SENSOR_COLOR, "color", camera.formats);
  add_formats(device, openni::SENSOR_DEPTH, "depth", camera.formats);
  add_formats(device, openni::SENSOR_IR, "infrared", camera.formats);
  device.close();
  return camera;
}

}  // namespace

Result<std::unique_ptr<RgbdSource>> make_openni2_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                        const Clock& clock) {
  CameraSourceOptions options{camera.width, camera.height, config.live, config.pacing};
  const std::string& device = config.openni2.device;
  if (device.size() >= ONI_MAX_STR) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("source.openni2.device: '{}' has {} characters, and OpenNI2 keeps {}",
                                                              device, device.size(), ONI_MAX_STR - 1));
  }
  if (is_openni2_recording(device)) {
    // Unlike a camera, it does not get better by waiting.
    OpenNi2Device recording(config.openni2, {camera.width, camera.height, config.live.rate_hz});
    if (Status readable = recording.open(false); !readable) {
      return tl::unexpected(std::move(readable.error()));
    }
    options.live.stall_timeout_s = kNoStall_s;  // the camera itself tells when a recording breaks off
  }
  auto opened = std::make_unique<OpenNi2Camera>(
      OpenNi2CameraOptions{config.openni2, config.live, config.pacing, camera.width, camera.height}, clock);
  return make_camera_source(std::move(opened), options, clock);
}

Result<std::vector<ListedCamera>> list_openni2_cameras() {
  OpenNi2Runtime runtime;
  if (Status held = runtime.hold(); !held) {
    return tl::unexpected(std::move(held.error()));
  }
  std::vector<ListedCamera> cameras;
  for (const OpenNi2Found& found : find_openni2_devices()) {
    cameras.push_back(list(found));
  }
  return cameras;
}

}  // namespace posed
