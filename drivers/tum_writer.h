#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/result.h"
#include "core/rgbd_frame.h"

namespace posed {

enum class ColorFormat { Png, Jpeg };

struct TumWriterOptions {
  double depth_units_per_metre = 5000.0;
  ColorFormat color_format = ColorFormat::Png;
  int jpeg_quality = 95;
};

/// Writes frames as a recording in the TUM RGB-D layout: rgb/STAMP.png, depth/STAMP.png, rgb.txt, depth.txt and, where frames carry
/// the true pose, groundtruth.txt (stamp tx ty tz qx qy qz qw of T_world_camera). The lists are written by `finish`, so a folder
/// without them is a recording that was broken off. Thread-bound. Errors: Io (a full disk included), naming the file.
class TumWriter {
 public:
  /// Makes the folders. Error InvalidArgument where `folder` holds a recording already.
  static Result<TumWriter> create(const std::filesystem::path& folder, const TumWriterOptions& options);

  /// Writes one frame; its `stamp_utc_ns` must be larger than that of the frame before (InvalidArgument).
  Status add_frame(const RgbdFrame& frame);

  /// Writes the lists. Call once, after the last frame.
  Status finish();

 private:
  TumWriter(std::filesystem::path folder, const TumWriterOptions& options);

  std::filesystem::path folder_;
  TumWriterOptions options_;
  std::int64_t last_stamp_ns_ = -1;
  std::string color_list_;
  std::string depth_list_;
  std::string groundtruth_;
};

}  // namespace posed
