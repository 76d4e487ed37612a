#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "config/config.h"
#include "core/pinhole_camera.h"
#include "core/result.h"

/// The synthetic world written out as a recording in the TUM RGB-D layout. All reentrant.
namespace posed {

struct SynthRequest {
  std::filesystem::path folder;
  SyntheticConfig world;  ///< `duration_s` does not count
  CameraIntrinsics camera;
  std::uint64_t frames = 0;
  bool replace = false;  ///< a recording that is in the folder already goes first
};

/// Intrinsics of a PrimeSense sensor (525 pixels at a width of 640) at another resolution: same field of view across, square
/// pixels, principal point in the middle.
CameraIntrinsics primesense_camera(int width, int height);

/// What a recording takes on the disk at most [bytes]: images as large as without compression.
std::uint64_t max_recording_bytes(const SynthRequest& request);

/// Makes the folder, refusing one that is not empty unless the request says to replace what is there, and checks the free space. Of
/// what is in the folder only a recording's own files are removed. Errors: InvalidArgument (not empty), Io (no room, no
/// permission).
Status prepare_recording_folder(const SynthRequest& request);

/// Writes rgb/, depth/, masks/ (255 on people), rgb.txt, depth.txt, groundtruth.txt and camera.toml, and returns the frames
/// written. Calls `go_on(frames done)` after each frame and stops early, with whole lists, where it returns false. Errors:
/// InvalidArgument, Io.
Result<std::uint64_t> write_synthetic_recording(const SynthRequest& request, const std::function<bool(std::uint64_t)>& go_on);

}  // namespace posed
