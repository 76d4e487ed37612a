#include "tools/posectl/device_report.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "config/toml_document.h"

namespace posed {
namespace {

bool has_stream(const ListedCamera& camera, std::string_view stream) {
  return std::any_of(camera.formats.begin(), camera.formats.end(), [&](const ListedFormat& f) { return f.stream == stream; });
}

bool has_size(const ListedCamera& camera, std::string_view stream, int width, int height) {
  return std::any_of(camera.formats.begin(), camera.formats.end(),
                     [&](const ListedFormat& f) { return f.stream == stream && f.width == width && f.height == height; });
}

/// A device's name as it may stand in a comment or on a terminal.
std::string on_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7f; }, '?');
  return text;
}

std::string size_text(const ListedFormat& format) {
  std::string text = format.width > 0 ? fmt::format("{}x{}", format.width, format.height) : "any size";
  return format.rate_hz > 0 ? fmt::format("{} {:.4g} Hz", text, format.rate_hz) : text;
}

std::string_view key_of(std::string_view kind) {
  return kind == "libcamera" ? "camera" : "device";
}

void append_camera(const ListedCamera& camera, std::string& text) {
  text += fmt::format("  {}\n    source.{}.{} = {}\n", on_one_line(camera.name), camera.kind, key_of(camera.kind),
                      posed::quoted(camera.id));
  for (auto format = camera.formats.begin(); format != camera.formats.end();) {
    text += fmt::format("    {:<8} {:<8} {}", format->stream, format->format, size_text(*format));
    const ListedFormat& first = *format;
    for (++format; format != camera.formats.end() && format->stream == first.stream && format->format == first.format; ++format) {
      text += ", " + size_text(*format);
    }
    text += '\n';
  }
}

const DriverListing* listing_of(const std::vector<DriverListing>& cameras, std::string_view kind) {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const DriverListing& l) { return l.kind == kind; });
  return found == cameras.end() ? nullptr : &*found;
}

/// Cameras of a driver that deliver a stream, those that have 640x480 first, otherwise as listed.
std::vector<const ListedCamera*> cameras_with(const std::vector<DriverListing>& cameras, std::string_view kind,
                                              std::string_view stream) {
  std::vector<const ListedCamera*> found;
  if (const DriverListing* listing = listing_of(cameras, kind)) {
    for (const ListedCamera& camera : listing->cameras) {
      if (has_stream(camera, stream)) {
        found.push_back(&camera);
      }
    }
  }
  std::stable_partition(found.begin(), found.end(), [&](const ListedCamera* c) { return has_size(*c, stream, 640, 480); });
  return found;
}

double rate_of(const ListedCamera& camera, std::string_view stream) {
  double rate_hz = 0;
  for (const ListedFormat& format : camera.formats) {
    if (format.stream == stream && format.width == 640 && format.height == 480) {
      rate_hz = std::max(rate_hz, format.rate_hz);
    }
  }
  return rate_hz > 0 ? std::clamp(rate_hz, 1.0, 30.0) : 30.0;
}

std::string header(const std::string& what) {
  return fmt::format(
      "# A configuration to start from, by `posectl devices --config`, for {}.\n"
      "# What is not here has its default; docs/configuration.md describes every key.\n",
      on_one_line(what));
}

std::string size_warning(const ListedCamera& camera, std::string_view stream) {
  return has_size(camera, stream, 640, 480)
             ? ""
             : fmt::format("# {} was not found to deliver 640x480 {}: write a calibration of a size that it has.\n",
                           on_one_line(camera.name), stream);
}

std::string openni2_config(const ListedCamera& camera) {
  return header(camera.name) +
         fmt::format(
             "\n[source]\nkind = \"openni2\"\n\n[source.live]\nrate_hz = {}  # Hz\n\n[source.openni2]\n"
             "device = {}  # \"\" takes the first one found, also in another USB port\n"
             "registration = true  # the device registers depth to colour\n\n[camera]\n"
             "# The size of the images, and values that are assumed of every such sensor. Better ones: posectl calibrate.\n{}"
             "calibration = \"primesense_default.toml\"\n",
             real_text(rate_of(camera, "depth")), posed::quoted(camera.id), size_warning(camera, "color"));
}

std::string pair_config(const ListedCamera& color, const ListedCamera& depth) {
  return header(fmt::format("{} with depth of {}", color.name, depth.name)) +
         fmt::format("\n[source]\nkind = {}\n\n[source.live]\nrate_hz = {}  # Hz\n\n[source.{}]\n{} = {}\n\n",
                     posed::quoted(color.kind), real_text(std::min(rate_of(color, "color"), rate_of(depth, "depth"))), color.kind,
                     key_of(color.kind), posed::quoted(color.id)) +
         fmt::format(
             "[source.depth]\ndevice = {}\n"
             "# Without a calibration of its own, depth must come registered to colour by the device. Where it does not, write "
             "one\n"
             "# for the depth camera, and where it is in the colour camera's frame:\n"
             "# calibration = \"depth.toml\"\n# T_camera_depth = [...]\n\n[camera]\n"
             "# The size of the images, and the units of depth. Nobody has calibrated this camera yet: posectl calibrate.\n{}"
             "calibration = \"uncalibrated_vga.toml\"\n",
             posed::quoted(depth.id), size_warning(color, "color"));
}

}  // namespace

std::string format_devices(const FoundDevices& devices) {
  std::string text = "Cameras\n";
  for (const DriverListing& listing : devices.cameras) {
    for (const ListedCamera& camera : listing.cameras) {
      append_camera(camera, text);
    }
    if (!listing.built) {
      text += fmt::format("  {}: not in this build\n", listing.kind);
    } else if (!listing.status) {
      text += fmt::format("  {}: could not look: {}\n", listing.kind, listing.status.error().message);
    } else if (listing.cameras.empty()) {
      text += fmt::format("  {}: none\n", listing.kind);
    }
  }
  text += "\nGPIO chips and lines\n";
  for (const std::string& line : devices.gpio) {
    text += fmt::format("  {}\n", line);
  }
  if (devices.gpio.empty()) {
    text += devices.gpio_built ? "  none\n" : "  not in this build\n";
  }
  return text;
}

std::string devices_json(const FoundDevices& devices) {
  nlohmann::ordered_json drivers = nlohmann::ordered_json::array();
  for (const DriverListing& listing : devices.cameras) {
    nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
    for (const ListedCamera& camera : listing.cameras) {
      nlohmann::ordered_json formats = nlohmann::ordered_json::array();
      for (const ListedFormat& f : camera.formats) {
        formats.push_back(
            {{"stream", f.stream}, {"format", f.format}, {"width", f.width}, {"height", f.height}, {"rate_hz", f.rate_hz}});
      }
      cameras.push_back({{"kind", camera.kind}, {"id", camera.id}, {"name", camera.name}, {"formats", std::move(formats)}});
    }
    drivers.push_back({{"kind", listing.kind},
                       {"built", listing.built},
                       {"error", listing.status ? "" : listing.status.error().message},
                       {"cameras", std::move(cameras)}});
  }
  const nlohmann::ordered_json root = {{"drivers", std::move(drivers)}, {"gpio_built", devices.gpio_built}, {"gpio", devices.gpio}};
  // A device's name may be anything; what is no UTF-8 is replaced rather than thrown for.
  return root.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Result<std::string> suggest_config(const std::vector<DriverListing>& cameras) {
  for (const ListedCamera* camera : cameras_with(cameras, "openni2", "depth")) {
    if (has_stream(*camera, "color")) {
      return openni2_config(*camera);
    }
  }
  const std::vector<const ListedCamera*> depths = cameras_with(cameras, "v4l2", "depth");
  std::vector<const ListedCamera*> colors = cameras_with(cameras, "v4l2", "color");
  const std::vector<const ListedCamera*> others = cameras_with(cameras, "libcamera", "color");
  colors.insert(colors.end(), others.begin(), others.end());
  for (const ListedCamera* depth : depths) {
    for (const ListedCamera* color : colors) {
      if (color->name == depth->name && color->id != depth->id) {
        return pair_config(*color, *depth);
      }
    }
  }
  for (const ListedCamera* depth : depths) {
    for (const ListedCamera* color : colors) {
      if (color->id != depth->id) {
        return pair_config(*color, *depth);
      }
    }
  }
  return make_error(ErrorCode::NotFound,
                    "no RGB-D camera was found: neither one by OpenNI2 nor a colour camera with a depth node of V4L2; "
                    "`posectl devices` shows what there is");
}

}  // namespace posed
