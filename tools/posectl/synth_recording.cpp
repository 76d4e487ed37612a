#include "tools/posectl/synth_recording.h"

#include <array>
#include <memory>
#include <optional>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "core/frame_pool.h"
#include "drivers/image_writer.h"
#include "drivers/synthetic_camera.h"
#include "drivers/tum_list.h"
#include "drivers/tum_writer.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

namespace fs = std::filesystem;

constexpr std::array kRecordingFiles{"rgb", "depth", "masks", "rgb.txt", "depth.txt", "groundtruth.txt", "camera.toml"};
constexpr std::uint64_t kBytesPerPixel = 3 + 2 + 1;  // colour, depth, mask

tl::unexpected<Error> folder_error(const fs::path& path, const std::error_code& error) {
  return make_error(ErrorCode::Io, fmt::format("cannot use {}: {}", path.string(), error.message()));
}

Status write_frame(SyntheticCamera& camera, std::uint64_t index, RgbdFrame& frame, std::vector<std::uint8_t>& mask_pixels,
                   const fs::path& masks, TumWriter& writer) {
  const int width = camera.intrinsics().width;
  const ImageView<std::uint8_t> mask{mask_pixels.data(), width, camera.intrinsics().height, width, 1};
  return camera.render(index, frame, mask).and_then([&] { return writer.add_frame(frame); }).and_then([&] {
    return write_png_gray8(masks / (format_stamp(frame.stamp_utc_ns) + ".png"), mask);
  });
}

}  // namespace

CameraIntrinsics primesense_camera(int width, int height) {
  const CameraIntrinsics vga;
  CameraIntrinsics camera;
  const double scale = static_cast<double>(width) / vga.width;
  camera.width = width;
  camera.height = height;
  camera.fx = vga.fx * scale;
  camera.fy = vga.fy * scale;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.baseline_fx = vga.baseline_fx * scale;
  return camera;
}

std::uint64_t max_recording_bytes(const SynthRequest& request) {
  return request.frames * static_cast<std::uint64_t>(request.camera.width) * static_cast<std::uint64_t>(request.camera.height) *
         kBytesPerPixel;
}

Status prepare_recording_folder(const SynthRequest& request) {
  std::error_code error;
  fs::create_directories(request.folder, error);
  if (error) {
    return folder_error(request.folder, error);
  }
  const bool empty = fs::is_empty(request.folder, error);
  if (error) {
    return folder_error(request.folder, error);
  }
  if (!empty && !request.replace) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{} is not empty; name another folder, or give --force to replace the recording in it",
                                  request.folder.string()));
  }
  for (const char* name : kRecordingFiles) {
    fs::remove_all(request.folder / name, error);
    if (error) {
      return folder_error(request.folder / name, error);
    }
  }
  const fs::space_info space = fs::space(request.folder, error);
  if (!error && space.available < max_recording_bytes(request)) {
    return make_error(ErrorCode::Io, fmt::format("{} has {} MB free, and {} frames can take {} MB; ask for fewer or smaller ones",
                                                 request.folder.string(), space.available / 1'000'000, request.frames,
                                                 max_recording_bytes(request) / 1'000'000));
  }
  fs::create_directories(request.folder / "masks", error);
  return error ? Status(folder_error(request.folder, error)) : Status();
}

Result<std::uint64_t> write_synthetic_recording(const SynthRequest& request, const std::function<bool(std::uint64_t)>& go_on) {
  Result<std::unique_ptr<SyntheticCamera>> camera = SyntheticCamera::create(request.world, request.camera);
  if (!camera) {
    return tl::unexpected(camera.error());
  }
  TumWriterOptions options;
  options.depth_units_per_metre = request.camera.depth_units_per_metre;
  Result<TumWriter> writer = TumWriter::create(request.folder, options);
  if (!writer) {
    return tl::unexpected(writer.error());
  }
  FramePool pool(request.camera.width, request.camera.height, 1);
  std::optional<FrameWriter> frame = pool.acquire();
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(request.camera.width) * static_cast<std::size_t>(request.camera.height));
  std::uint64_t written = 0;
  for (bool more = true; more && written < request.frames; more = go_on(written)) {
    if (const Status status = write_frame(**camera, written, **frame, mask, request.folder / "masks", *writer); !status) {
      return tl::unexpected(status.error());
    }
    ++written;
  }
  const Status finished = writer->commit().and_then([&] {
    return write_whole_file(request.folder / "camera.toml",
                            format_camera(request.camera, "The camera of this synthetic recording."));
  });
  return finished.map([written] { return written; });
}

}  // namespace posed
