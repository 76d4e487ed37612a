#include "drivers/openni2/openni2_devices.h"

#include <array>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace posed {

namespace {

using Opened = Result<std::unique_ptr<OpenNi2Watch>>;

/// For a message: what there is, where what was asked for is not.
std::string among(const std::vector<std::string>& names) {
  return names.empty() ? "OpenNI2 finds no camera" : fmt::format("OpenNI2 finds {}", fmt::join(names, ", "));
}

Opened open_uri(const std::string& uri, openni::Device& device) {
  auto watch = std::make_unique<OpenNi2Watch>(uri);
  if (device.open(uri.c_str()) != openni::STATUS_OK) {
    return make_error(ErrorCode::Unavailable,
                      fmt::format("OpenNI2 camera '{}' cannot be opened (another program may have it): {}", uri, openni2_error()));
  }
  return watch;
}

Opened open_recording(const std::string& path, openni::Device& device) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return make_error(ErrorCode::NotFound, fmt::format("source.openni2.device: there is no recording '{}'", path));
  }
  auto watch = std::make_unique<OpenNi2Watch>(path);
  if (device.open(path.c_str()) != openni::STATUS_OK || !device.isFile()) {
    device.close();
    return make_error(ErrorCode::BadData, fmt::format("'{}' cannot be read as an OpenNI recording: {}", path, openni2_error()));
  }
  return watch;
}

Opened open_first(openni::Device& device) {
  const std::vector<OpenNi2Found> found = find_openni2_devices();
  if (found.empty()) {
    return make_error(ErrorCode::NotFound, "OpenNI2 finds no camera");
  }
  return open_uri(found.front().uri, device);
}

Opened open_serial(std::string_view serial, openni::Device& device) {
  std::vector<std::string> seen;
  for (const OpenNi2Found& found : find_openni2_devices()) {
    Opened opened = open_uri(found.uri, device);
    if (!opened) {
      seen.push_back(found.uri + " (which cannot be opened)");
      continue;
    }
    const std::string number = openni2_serial(device);
    if (number == serial) {
      return opened;
    }
    device.close();
    seen.push_back(number.empty() ? found.uri + " (which tells no serial number)" : std::string(kOpenNi2Serial) + number);
  }
  return make_error(ErrorCode::NotFound, fmt::format("there is no OpenNI2 camera '{}{}': {}", kOpenNi2Serial, serial, among(seen)));
}

Opened open_named(const std::string& uri, openni::Device& device) {
  std::vector<std::string> seen;
  for (const OpenNi2Found& found : find_openni2_devices()) {
    if (found.uri == uri) {
      return open_uri(uri, device);
    }
    seen.push_back(found.uri);
  }
  // Some drivers open what they do not announce.
  Opened opened = open_uri(uri, device);
  if (!opened) {
    return make_error(ErrorCode::NotFound, fmt::format("there is no OpenNI2 camera '{}': {}", uri, among(seen)));
  }
  return opened;
}

}  // namespace

bool is_openni2_recording(std::string_view device) {
  return device.ends_with(".oni");
}

std::vector<OpenNi2Found> find_openni2_devices() {
  openni::Array<openni::DeviceInfo> listed;
  openni::OpenNI::enumerateDevices(&listed);
  std::vector<OpenNi2Found> found;
  for (int i = 0; i < listed.getSize(); ++i) {
    // OpenNI2 lists a recording that was opened before as a device.
    if (!is_openni2_recording(listed[i].getUri())) {
      found.push_back({listed[i].getUri(), listed[i].getVendor(), listed[i].getName()});
    }
  }
  return found;
}

std::string openni2_serial(openni::Device& device) {
  std::array<char, ONI_MAX_STR> text{};
  int size = static_cast<int>(text.size()) - 1;
  if (device.getProperty(openni::DEVICE_PROPERTY_SERIAL_NUMBER, text.data(), &size) != openni::STATUS_OK) {
    return {};
  }
  return text.data();
}

Opened open_openni2_device(const std::string& wanted, openni::Device& device) {
  if (wanted.empty()) {
    return open_first(device);
  }
  if (is_openni2_recording(wanted)) {
    return open_recording(wanted, device);
  }
  if (wanted.starts_with(kOpenNi2Serial)) {
    return open_serial(std::string_view(wanted).substr(kOpenNi2Serial.size()), device);
  }
  return open_named(wanted, device);
}

}  // namespace posed
