#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/result.h"

/// Whole files in, whole files out. Reentrant. Messages name the file and what the system said.
namespace posed {

/// No image, list or trajectory comes near this; what is larger is refused before it is read.
constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20;

/// Reads `path` into `bytes`, whose capacity is kept from call to call. Errors: NotFound; BadData where it is no regular file or
/// larger than `max_bytes`; Io.
Status read_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes, std::size_t max_bytes = kMaxFileBytes);

/// Writes a temporary file beside `path` and renames it, so that a reader sees the old file or the whole new one. What exists and
/// is no regular file (/dev/stdout, a pipe) is written to directly. It does not wait for the disk (no fsync). Errors: NotFound (no
/// such folder); Io, a full disk included; the temporary file is then removed.
Status write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace posed
