#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace posed {

/// The contents of a regular file of at most 64 KiB, many times the size of any configuration. Error code: Io. Reentrant.
Result<std::string> read_text_file(const std::filesystem::path& path);

}  // namespace posed
