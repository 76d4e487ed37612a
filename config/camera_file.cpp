#include <algorithm>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "config/config_loader.h"
#include "config/data_file.h"
#include "config/strict_reader.h"
#include "config/text_file.h"

namespace posed {

namespace {

/// Whether the lens model maps distinct directions to distinct pixels across the image, so that it can be inverted: the radial
/// factor times the radius must grow with the radius, up to the farthest corner.
bool is_distortion_invertible(const CameraIntrinsics& k) {
  const double x = std::max(k.cx, k.width - 1 - k.cx) / k.fx;
  const double y = std::max(k.cy, k.height - 1 - k.cy) / k.fy;
  constexpr int kSteps = 64;
  for (int i = 1; i <= kSteps; ++i) {
    const double r2 = (x * x + y * y) * i / kSteps;
    if (1.0 + r2 * (3.0 * k.k1 + r2 * (5.0 * k.k2 + r2 * 7.0 * k.k3)) <= 0.0) {
      return false;
    }
  }
  return true;
}

}  // namespace

Result<CameraIntrinsics> parse_camera(const std::string& text, const std::filesystem::path& name) {
  CameraIntrinsics k;
  StrictReader reader(name, camera_schema(k));
  reader.read(text);
  reader.require(k.cx <= k.width - 1, {"camera.cx", "camera.width"},
                 fmt::format("outside of the image, allowed 0 to {}", k.width - 1));
  reader.require(k.cy <= k.height - 1, {"camera.cy", "camera.height"},
                 fmt::format("outside of the image, allowed 0 to {}", k.height - 1));
  reader.require(is_distortion_invertible(k),
                 {"camera.distortion", "camera.fx", "camera.fy", "camera.cx", "camera.cy", "camera.width", "camera.height"},
                 "the lens model folds back on itself within the image, so it cannot be undone; check the coefficients' order k1, "
                 "k2, p1, p2, k3");
  return reader.status().map([&] { return k; });
}

Result<CameraIntrinsics> load_camera(const std::filesystem::path& path) {
  const Result<std::filesystem::path> file = find_file(path, {""}, calibration_folders());
  if (!file) {
    return make_error(file.error().code, fmt::format("{}: cannot be read: {}", path.string(), file.error().message));
  }
  return read_text_file(*file).and_then([&](const std::string& text) { return parse_camera(text, *file); });
}

}  // namespace posed
