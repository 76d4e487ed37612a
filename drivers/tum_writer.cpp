#include "drivers/tum_writer.h"

#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/file_io.h"
#include "drivers/image_writer.h"
#include "drivers/tum_list.h"

namespace posed {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kColorHeader = "# color images\n# timestamp filename\n";
constexpr std::string_view kDepthHeader = "# depth maps\n# timestamp filename\n";
constexpr std::string_view kGroundtruthHeader = "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n";

Status write_text(const fs::path& path, std::string_view text) {
  return write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace

Result<TumWriter> TumWriter::create(const fs::path& folder, const TumWriterOptions& options) {
  std::error_code error;
  if (fs::exists(folder / "rgb.txt", error)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{} holds a recording already (rgb.txt); choose another folder or remove it", folder.string()));
  }
  for (const fs::path& path : {folder / "rgb", folder / "depth"}) {
    fs::create_directories(path, error);
    if (error) {
      return make_error(ErrorCode::Io, fmt::format("cannot make folder {}: {}", path.string(), error.message()));
    }
  }
  return TumWriter(folder, options);
}

TumWriter::TumWriter(fs::path folder, const TumWriterOptions& options)
    : folder_(std::move(folder)),
      options_(options),
      color_list_(kColorHeader),
      depth_list_(kDepthHeader),
      groundtruth_(kGroundtruthHeader) {}

Status TumWriter::add_frame(const RgbdFrame& frame) {
  if (frame.stamp_utc_ns <= last_stamp_ns_) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("frame {}: stamp {} ns is not larger than the one before, {} ns",
                                                              frame.sequence, frame.stamp_utc_ns, last_stamp_ns_));
  }
  const std::string stamp = format_stamp(frame.stamp_utc_ns);
  const bool is_png = options_.color_format == ColorFormat::Png;
  const std::string color = fmt::format("rgb/{}.{}", stamp, is_png ? "png" : "jpg");
  const std::string depth = fmt::format("depth/{}.png", stamp);
  Status written =
      is_png ? write_png_bgr8(folder_ / color, frame.bgr) : write_jpeg_bgr(folder_ / color, frame.bgr, options_.jpeg_quality);
  if (written) {
    written = write_png_depth16(folder_ / depth, frame.depth_m, options_.depth_units_per_metre);
  }
  if (!written) {
    return written;
  }
  last_stamp_ns_ = frame.stamp_utc_ns;
  color_list_ += fmt::format("{} {}\n", stamp, color);
  depth_list_ += fmt::format("{} {}\n", stamp, depth);
  if (frame.T_world_camera_truth) {
    const Eigen::Vector3d& t = frame.T_world_camera_truth->translation();
    const Eigen::Quaterniond& q = frame.T_world_camera_truth->rotation();
    groundtruth_ += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", stamp, t.x(), t.y(), t.z(), q.x(), q.y(),
                                q.z(), q.w());
  }
  return {};
}

Status TumWriter::finish() {
  Status written = write_text(folder_ / "depth.txt", depth_list_);
  if (written && groundtruth_.size() > kGroundtruthHeader.size()) {
    written = write_text(folder_ / "groundtruth.txt", groundtruth_);
  }
  // Last: whoever sees rgb.txt sees a whole recording.
  return written ? write_text(folder_ / "rgb.txt", color_list_) : written;
}

}  // namespace posed
