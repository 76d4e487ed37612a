#include "drivers/v4l2/v4l2_listing.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "drivers/v4l2/v4l2_device.h"
#include "drivers/v4l2/v4l2_format.h"

namespace posed {

namespace {

constexpr std::uint32_t kMostEntries = 256;  // of a list that a driver never ends

/// N of "videoN".
std::optional<int> node_number(std::string_view name) {
  constexpr std::string_view kPrefix = "video";
  if (!name.starts_with(kPrefix)) {
    return std::nullopt;
  }
  int number = 0;
  const char* end = name.data() + name.size();
  const auto [stopped, error] = std::from_chars(name.data() + kPrefix.size(), end, number);
  return error == std::errc() && stopped == end ? std::optional(number) : std::nullopt;
}

double rate_of(const v4l2_fract& period) {
  return period.numerator > 0 ? static_cast<double>(period.denominator) / period.numerator : 0.0;
}

/// The highest; 0 where the driver does not tell.
double highest_rate(const V4l2Device& device, std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  double highest = 0;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = fourcc;
    interval.width = width;
    interval.height = height;
    if (device.ioctl(VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) {
      break;
    }
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
      return rate_of(interval.stepwise.min);
    }
    highest = std::max(highest, rate_of(interval.discrete));
  }
  return highest;
}

ListedFormat listed_format(const V4l2Device& device, std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  const V4l2PixelFormat* known = find_v4l2_format(fourcc);
  const auto depths = v4l2_depth_formats();
  const bool is_depth = std::any_of(depths.begin(), depths.end(), [&](const auto& depth) { return depth.fourcc == fourcc; });
  return {is_depth ? "depth" : "color", known != nullptr ? std::string(known->name) : fourcc_text(fourcc), static_cast<int>(width),
          static_cast<int>(height), highest_rate(device, fourcc, width, height)};
}

/// All sizes of a format; of a range the largest.
void list_sizes(const V4l2Device& device, std::uint32_t fourcc, std::vector<ListedFormat>& formats) {
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (device.ioctl(VIDIOC_ENUM_FRAMESIZES, &size) < 0) {
      if (i == 0) {
        formats.push_back(listed_format(device, fourcc, 0, 0));
      }
      return;
    }
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      formats.push_back(listed_format(device, fourcc, size.stepwise.max_width, size.stepwise.max_height));
      return;
    }
    formats.push_back(listed_format(device, fourcc, size.discrete.width, size.discrete.height));
  }
}

/// Nothing where the node delivers no images.
std::optional<ListedCamera> list_node(V4l2System& system, const std::string& path) {
  ListedCamera camera{"v4l2", path, {}, {}};
  V4l2Device device(system, path);
  if (Status opened = device.open(); !opened) {
    camera.name = opened.error().message;
    return camera;
  }
  const Result<v4l2_capability> capability = device.capability();
  constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if (!capability || (capabilities_of(*capability) & kNeeded) != kNeeded) {
    return std::nullopt;
  }
  // The kernel's arrays of bytes hold texts with their ends.
  camera.name =
      fmt::format("{} ({})", reinterpret_cast<const char*>(capability->card), reinterpret_cast<const char*>(capability->bus_info));
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_fmtdesc description{};
    description.index = i;
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.ioctl(VIDIOC_ENUM_FMT, &description) < 0) {
      break;
    }
    list_sizes(device, description.pixelformat, camera.formats);
  }
  return camera;
}

}  // namespace

Result<std::vector<ListedCamera>> list_v4l2_cameras() {
  return list_v4l2_cameras(machine_v4l2(), "/dev");
}

Result<std::vector<ListedCamera>> list_v4l2_cameras(V4l2System& system, const std::filesystem::path& devices) {
  std::vector<int> numbers;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(devices, error), end; !error && entry != end; entry.increment(error)) {
    if (const std::optional<int> number = node_number(entry->path().filename().native())) {
      numbers.push_back(*number);
    }
  }
  if (error) {
    return make_error(ErrorCode::Io, fmt::format("{}: {}", devices.string(), error.message()));
  }
  std::sort(numbers.begin(), numbers.end());
  std::vector<ListedCamera> cameras;
  for (const int number : numbers) {
    if (std::optional<ListedCamera> camera = list_node(system, (devices / fmt::format("video{}", number)).string())) {
      cameras.push_back(std::move(*camera));
    }
  }
  return cameras;
}

}  // namespace posed
