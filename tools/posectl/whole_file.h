#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.h"

/// Whole text files in and out (core/file_io.h), and the question whether out will work. All reentrant.
namespace posed {

/// Errors: as `read_file`.
Result<std::string> read_whole_file(const std::filesystem::path& path);

/// Whether `path` could be written: its folder exists and may be written to, and it is not a folder itself. To be asked before a
/// long run. Error: Io.
Status check_writable(const std::filesystem::path& path);

/// Errors: as `write_file`.
Status write_whole_file(const std::filesystem::path& path, std::string_view contents);

}  // namespace posed
