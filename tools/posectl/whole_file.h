#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.h"

/// Whole files in and out. All reentrant.
namespace posed {

/// Errors: NotFound, or Io with the system's reason.
Result<std::string> read_whole_file(const std::filesystem::path& path);

/// Whether `path` could be written: its folder exists and may be written to, and it is not a folder itself. To be asked before a
/// long run. Error: Io.
Status check_writable(const std::filesystem::path& path);

/// Writes a file beside `path` and renames it, so that a reader sees the old file or the whole new one. What is not a regular file
/// (/dev/stdout, a pipe) is written to directly. Error: Io.
Status write_whole_file(const std::filesystem::path& path, std::string_view contents);

}  // namespace posed
