#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/result.h"

namespace posed {

/// Reads `path`, strictly: an unknown key, a wrong type, a value out of range, a duplicate or a syntax error is an error that names
/// file, line, column, key, the value read and what is allowed. All mistakes of the file are reported, one a line. Also reads the
/// camera calibration that the file names, and makes relative paths start at the file's folder: `camera.calibration`,
/// `source.replay.*` and, where the detector is enabled, `detector.models` come back ready to open. Error code: InvalidConfig, or
/// Io where `path` cannot be read. Reentrant.
Result<Config> load_config(const std::filesystem::path& path);

/// As `load_config`, from text; `name` stands for the file in messages and its folder for relative paths.
Result<Config> parse_config(const std::string& text, const std::filesystem::path& name);

/// The built-in defaults with the camera calibration they name.
Result<Config> default_config();

/// Reads a camera calibration file as strictly. A relative `path` that does not exist is looked for in `calibration_folders()`.
/// Error code: InvalidConfig, or Io where no such file can be read. Reentrant.
Result<CameraIntrinsics> load_camera(const std::filesystem::path& path);

/// As `load_camera`, from text; `name` stands for the file in messages.
Result<CameraIntrinsics> parse_camera(const std::string& text, const std::filesystem::path& name);

/// Where shipped models are looked for: $POSED_MODEL_PATH, then as `calibration_folders`.
std::vector<std::filesystem::path> model_folders();

/// Where shipped calibrations are looked for, in this order: $POSED_CAMERA_PATH (colon-separated), the build's source tree, the
/// installed data folder. Reads the environment: reentrant as long as nothing changes it.
std::vector<std::filesystem::path> calibration_folders();

}  // namespace posed
