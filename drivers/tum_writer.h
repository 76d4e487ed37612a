#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/append_file.h"
#include "core/file_descriptor.h"
#include "core/result.h"
#include "core/rgbd_frame.h"
#include "drivers/encoded_frame.h"

namespace posed {

struct TumWriterOptions : EncodingOptions {
  bool sync = false;  ///< `commit` waits until the disk has everything
};

/// Writes frames as a recording in the TUM RGB-D layout: rgb/STAMP.png, depth/STAMP.png, rgb.txt, depth.txt and, where frames carry
/// the true pose, groundtruth.txt (stamp tx ty tz qx qy qz qw of T_world_camera). Files have the stamp of the colour image;
/// depth.txt says when the depth image was taken.
///
/// The recording is valid at any moment and holds the committed frames: a line stands in a list only after its images are whole
/// files, and in rgb.txt last. So one that is broken off by a kill keeps every committed frame, and with `sync` a power cut
/// takes none either. What it can leave besides are images that no list names and one torn line at the end of a list, which the
/// reader skips. Syncing is by the whole file system, once a commit (syncfs): an image file at a time would cost several times as
/// much. Thread-bound. Errors: Io (a full disk included), naming the file.
class TumWriter {
 public:
  /// Makes the folders. Error InvalidArgument where `folder` holds a recording already.
  static Result<TumWriter> create(const std::filesystem::path& folder, const TumWriterOptions& options);

  /// Writes the images of one frame, which is not in the lists before `commit`; its `stamp_utc_ns` must be larger than that of the
  /// frame before (InvalidArgument). An error leaves none of its files, and the frames before it can still be committed.
  Status add_frame(const RgbdFrame& frame);
  Status add_frame(const EncodedFrame& frame);

  /// Writes the lines of the frames since the last commit. The lists themselves are made by the first commit (InvalidArgument where
  /// another process has made them meanwhile). An error leaves these frames out of rgb.txt.
  Status commit();

  /// Frames of this recording that `commit` has made part of it.
  std::uint64_t frames_committed() const { return frames_committed_; }

 private:
  /// A list that is made at its first line.
  struct List {
    std::string pending;
    std::optional<AppendFile> file;
  };

  TumWriter(std::filesystem::path folder, const TumWriterOptions& options, FileDescriptor directory);
  Status open_list(List& list, const char* name, std::string_view header) const;
  Status write_lines(List& list) const;

  std::filesystem::path folder_;
  TumWriterOptions options_;
  FileDescriptor directory_;  // opened before the first file, so that syncing tells of errors since then
  EncodedFrame encoded_;
  std::int64_t last_stamp_ns_ = -1;
  std::int64_t last_depth_stamp_ns_ = -1;  // no two are the same, and the list is ordered
  std::uint64_t frames_pending_ = 0;
  std::uint64_t frames_committed_ = 0;
  List color_;
  List depth_;
  List groundtruth_;
};

}  // namespace posed
