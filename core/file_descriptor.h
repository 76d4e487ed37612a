#pragma once

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <span>
#include <unistd.h>
#include <utility>

#include "core/result.h"

/// What the file functions of this folder share. Reentrant.
namespace posed {

/// Owns an open file of the system, or none (-1).
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~FileDescriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }

  int get() const { return fd_; }

  /// Closes it with the error that a file system may have kept until now (quota, network): 0 or the error number.
  int close() {
    const int fd = std::exchange(fd_, -1);
    return ::close(fd) == 0 ? 0 : errno;
  }

 private:
  int fd_;
};

/// The error number `error` in words: "cannot ACTION PATH: REASON", NotFound or Io, with advice where the disk is full.
tl::unexpected<Error> system_error(const char* action, const std::filesystem::path& path, int error);

/// Writes everything; 0, or the error number. A disk that fills up in the middle of a write first writes a part and reports with
/// the next call.
int write_all(int fd, std::span<const std::uint8_t> bytes);

}  // namespace posed
