#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/file_descriptor.h"
#include "core/result.h"

namespace posed {

/// Replaces a file by a new one that is written piece by piece: whoever opens `path`, also after a power cut, finds the old file or
/// the whole new one. Written to `path`.part in the same folder (whose leftover from a killed process is overwritten), synced,
/// renamed. A file that is destroyed before `commit` leaves nothing behind. Thread-bound; two processes that write the same file
/// exclude each other. After an error only its destruction makes sense. Errors name the file and what the system said.
class AtomicFile {
 public:
  /// Errors: NotFound (no such folder); Io (not writable, or no regular file); Unavailable (another process writes it now).
  static Result<AtomicFile> create(const std::filesystem::path& path);

  AtomicFile(AtomicFile&& other) noexcept = default;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Appends; may block for as long as the disk does. Error: Io, a full disk included.
  Status write(std::span<const std::uint8_t> bytes);

  /// Puts the new file into the place of the old one and waits until the disk has it.
  Status commit();

 private:
  AtomicFile(std::filesystem::path path, std::filesystem::path part, FileDescriptor file);
  Status flush();

  std::filesystem::path path_;
  std::filesystem::path part_;
  FileDescriptor file_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace posed
