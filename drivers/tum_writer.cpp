#include "drivers/tum_writer.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <initializer_list>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "core/file_io.h"
#include "drivers/tum_list.h"

namespace posed {

namespace {

namespace fs = std::filesystem;

constexpr const char* kColorList = "rgb.txt";
constexpr const char* kDepthList = "depth.txt";
constexpr std::string_view kColorHeader = "# color images\n# timestamp filename\n";
constexpr std::string_view kDepthHeader = "# depth maps\n# timestamp filename\n";
constexpr std::string_view kGroundtruthHeader = "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n";

std::string groundtruth_line(const std::string& stamp, const Se3& T_world_camera) {
  const Eigen::Vector3d& t = T_world_camera.translation();
  const Eigen::Quaterniond& q = T_world_camera.rotation();
  return fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", stamp, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                     q.w());
}

}  // namespace

Result<TumWriter> TumWriter::create(const fs::path& folder, const TumWriterOptions& options) {
  std::error_code error;
  for (const char* list : {kColorList, kDepthList}) {
    if (fs::exists(folder / list, error)) {
      return make_error(
          ErrorCode::InvalidArgument,
          fmt::format("{} holds a recording already ({}); choose another folder or remove it", folder.string(), list));
    }
  }
  for (const fs::path& path : {folder / "rgb", folder / "depth"}) {
    fs::create_directories(path, error);
    if (error) {
      return make_error(ErrorCode::Io, fmt::format("cannot make folder {}: {}", path.string(), error.message()));
    }
  }
  FileDescriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0) {
    return system_error("open", folder, errno);
  }
  return TumWriter(folder, options, std::move(directory));
}

TumWriter::TumWriter(fs::path folder, const TumWriterOptions& options, FileDescriptor directory)
    : folder_(std::move(folder)), options_(options), directory_(std::move(directory)) {}

Status TumWriter::add_frame(const RgbdFrame& frame) {
  return encode_frame(frame, options_, encoded_).and_then([this] { return add_frame(encoded_); });
}

Status TumWriter::add_frame(const EncodedFrame& frame) {
  if (frame.stamp_utc_ns <= last_stamp_ns_) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("frame {}: stamp {} ns is not larger than the one before, {} ns",
                                                              frame.sequence, frame.stamp_utc_ns, last_stamp_ns_));
  }
  const std::string stamp = format_stamp(frame.stamp_utc_ns);
  const std::string color = fmt::format("rgb/{}.{}", stamp, frame.color_format == ColorFormat::Png ? "png" : "jpg");
  const std::string depth = fmt::format("depth/{}.png", stamp);
  if (Status written = write_file(folder_ / color, frame.color); !written) {
    return written;
  }
  if (Status written = write_file(folder_ / depth, frame.depth); !written) {
    std::error_code ignored;
    fs::remove(folder_ / color, ignored);
    return written;
  }
  last_stamp_ns_ = frame.stamp_utc_ns;
  last_depth_stamp_ns_ = std::max(last_depth_stamp_ns_ + 1, frame.stamp_utc_ns + frame.depth_offset_ns);
  color_.pending += fmt::format("{} {}\n", stamp, color);
  depth_.pending += fmt::format("{} {}\n", format_stamp(last_depth_stamp_ns_), depth);
  if (frame.T_world_camera_truth) {
    groundtruth_.pending += groundtruth_line(stamp, *frame.T_world_camera_truth);
  }
  ++frames_pending_;
  return {};
}

Status TumWriter::commit() {
  if (frames_pending_ == 0) {
    return {};
  }
  Status status = open_list(depth_, kDepthList, kDepthHeader)
                      .and_then([this] { return open_list(groundtruth_, "groundtruth.txt", kGroundtruthHeader); })
                      .and_then([this] { return open_list(color_, kColorList, kColorHeader); });
  if (status && options_.sync && ::syncfs(directory_.get()) != 0) {
    status = system_error("write", folder_, errno);
  }
  // rgb.txt last: what it names has its depth and its true pose.
  for (List* list : {&depth_, &groundtruth_, &color_}) {
    status = status ? write_lines(*list) : status;
  }
  if (status) {
    frames_committed_ += std::exchange(frames_pending_, 0);
  }
  return status;
}

Status TumWriter::open_list(List& list, const char* name, std::string_view header) const {
  if (list.file || list.pending.empty()) {
    return {};
  }
  Result<AppendFile> file = AppendFile::create(folder_ / name);
  if (!file) {
    return tl::unexpected(std::move(file).error());
  }
  list.file.emplace(*std::move(file));
  return list.file->append(header);
}

Status TumWriter::write_lines(List& list) const {
  if (list.pending.empty()) {
    return {};
  }
  Status written = list.file->append(list.pending);
  if (written && options_.sync) {
    written = list.file->sync();
  }
  if (written) {
    list.pending.clear();
  }
  return written;
}

}  // namespace posed
