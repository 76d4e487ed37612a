#include "tools/posectl/frame_sink.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <lcm/lcm-cpp.hpp>
#include <posed/rgbd_frame_t.hpp>

#include "core/clock.h"
#include "core/file_descriptor.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

namespace fs = std::filesystem;

class TumSink final : public FrameSink {
 public:
  TumSink(TumWriter writer, fs::path camera_path, std::string camera_file)
      : writer_(std::move(writer)), camera_path_(std::move(camera_path)), camera_file_(std::move(camera_file)) {}

  Status add(const EncodedFrame& frame) override {
    if (!camera_file_.empty()) {
      if (Status written = write_whole_file(camera_path_, camera_file_); !written) {
        return written;
      }
      camera_file_.clear();
    }
    return writer_.add_frame(frame);
  }

  Status commit() override { return writer_.commit(); }

 private:
  TumWriter writer_;
  fs::path camera_path_;
  std::string camera_file_;  // empty once it is written
};

rgbd_frame_t message_of(const CameraIntrinsics& camera) {
  rgbd_frame_t message{};
  message.width = camera.width;
  message.height = camera.height;
  message.fx = camera.fx;
  message.fy = camera.fy;
  message.cx = camera.cx;
  message.cy = camera.cy;
  const std::array distortion{camera.k1, camera.k2, camera.p1, camera.p2, camera.k3};
  std::copy(distortion.begin(), distortion.end(), message.distortion);
  message.depth_units_per_metre = camera.depth_units_per_metre;
  return message;
}

class LcmLogSink final : public FrameSink {
 public:
  LcmLogSink(fs::path path, std::unique_ptr<lcm::LogFile> log, const CameraIntrinsics& camera, const std::string& channel)
      : path_(std::move(path)), log_(std::move(log)), message_(message_of(camera)) {
    event_.channel = channel;
  }

  Status add(const EncodedFrame& frame) override {
    message_.utime = frame.stamp_utc_ns / kNsPerUs;
    message_.sequence = static_cast<std::int64_t>(frame.sequence);
    message_.color_format = frame.color_format == ColorFormat::Png ? rgbd_frame_t::COLOR_PNG : rgbd_frame_t::COLOR_JPEG;
    message_.color_size = static_cast<std::int32_t>(frame.color.size());
    message_.color = frame.color;
    message_.depth_size = static_cast<std::int32_t>(frame.depth.size());
    message_.depth = frame.depth;
    encoded_.resize(static_cast<std::size_t>(message_.getEncodedSize()));
    message_.encode(encoded_.data(), 0, static_cast<int>(encoded_.size()));
    event_.timestamp = message_.utime;
    event_.datalen = static_cast<std::int32_t>(encoded_.size());
    event_.data = encoded_.data();
    errno = 0;
    if (log_->writeEvent(&event_) != 0 || std::fflush(log_->getFilePtr()) != 0) {
      return system_error("write", path_, errno);
    }
    return {};
  }

  Status commit() override {
    // The whole file system, so that the file's name is there as well.
    if (std::fflush(log_->getFilePtr()) != 0 || ::syncfs(::fileno(log_->getFilePtr())) != 0) {
      return system_error("write", path_, errno);
    }
    return {};
  }

 private:
  fs::path path_;
  std::unique_ptr<lcm::LogFile> log_;
  rgbd_frame_t message_;
  lcm::LogEvent event_{};
  std::vector<std::uint8_t> encoded_;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> make_tum_sink(const fs::path& folder, const EncodingOptions& options, std::string camera_file) {
  const fs::path camera_path = folder / "camera.toml";
  std::error_code ignored;
  if (fs::exists(camera_path, ignored)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{} exists already; choose another folder or remove it", camera_path.string()));
  }
  TumWriterOptions writer_options{options};
  writer_options.sync = true;
  Result<TumWriter> writer = TumWriter::create(folder, writer_options);
  if (!writer) {
    return tl::unexpected(std::move(writer).error());
  }
  return std::make_unique<TumSink>(*std::move(writer), camera_path, std::move(camera_file));
}

Result<std::unique_ptr<FrameSink>> make_lcm_log_sink(const fs::path& path, const std::string& channel,
                                                     const CameraIntrinsics& camera) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{} exists already; choose another name or remove it", path.string()));
  }
  errno = 0;
  auto log = std::make_unique<lcm::LogFile>(path.string(), "w");
  if (!log->good()) {
    return system_error("create", path, errno);
  }
  return std::make_unique<LcmLogSink>(path, std::move(log), camera, channel);
}

}  // namespace posed
