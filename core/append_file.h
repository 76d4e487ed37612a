#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "core/file_descriptor.h"
#include "core/result.h"

namespace posed {

/// A new text file that grows and is valid all the while. What `append` gave is in the file whole or not at all while the process
/// lives; one that is killed in the middle of `append` can leave a part of that text, at the file's end. Thread-bound. Errors: Io,
/// naming the file.
class AppendFile {
 public:
  /// Makes the file. Error InvalidArgument where it exists: of two processes that make it at once, one gets it. NotFound: no such
  /// folder.
  static Result<AppendFile> create(const std::filesystem::path& path);

  /// Where it fails (a full disk included), what it has written goes again.
  Status append(std::string_view text);

  /// Waits until the disk has what was appended.
  Status sync();

 private:
  AppendFile(std::filesystem::path path, FileDescriptor file) : path_(std::move(path)), file_(std::move(file)) {}

  std::filesystem::path path_;
  FileDescriptor file_;
  std::int64_t bytes_ = 0;
};

}  // namespace posed
