#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/se3.h"

/// Trajectories in the TUM RGB-D text format, one pose a line: `stamp tx ty tz qx qy qz qw`, stamp in seconds, position in metres,
/// '#' before comments. Source: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012. All reentrant.
namespace posed {

struct StampedPose {
  std::int64_t stamp_ns = 0;  ///< since the epoch of the file's stamps, exact
  Se3 T_world_camera;
};

/// In ascending order of the stamps, each stamp once.
using Trajectory = std::vector<StampedPose>;

/// Errors: NotFound, Io, and BadData with file and line for a line that is not a pose, a quaternion that is not of unit length, and
/// stamps that repeat or go back.
Result<Trajectory> read_trajectory(const std::filesystem::path& path);

/// As `read_trajectory`, from text; `name` stands for the file in messages.
Result<Trajectory> parse_trajectory(std::string_view text, std::string_view name);

/// The text of a trajectory file. Stamps lose nothing: six decimals, or nine where one needs them.
std::string format_trajectory(const Trajectory& trajectory);

/// Stamps [ns] of an image list such as rgb.txt (`stamp path` a line). Errors as `read_trajectory`.
Result<std::vector<std::int64_t>> read_frame_stamps(const std::filesystem::path& path);

/// Seconds in decimal notation, with or without exponent, to nanoseconds: exact up to nine decimals, rounded beyond.
/// InvalidArgument where `text` is not a non-negative number of seconds below 2^63 ns.
Result<std::int64_t> parse_trajectory_stamp(std::string_view text);

/// Inverse of `parse_trajectory_stamp` for `stamp_ns >= 0`.
std::string format_trajectory_stamp(std::int64_t stamp_ns);

}  // namespace posed
