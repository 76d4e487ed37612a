#include "core/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

namespace posed {

namespace {

constexpr std::size_t kBufferBytes = 1 << 16;

bool same_file(int fd, const std::filesystem::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(fd, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

/// Opens `part`, locks it and empties it. Not emptied before it is locked: until then it may be what another process is about to
/// rename, or has just renamed, into the file itself.
Result<FileDescriptor> open_locked(const std::filesystem::path& part) {
  constexpr int kAttempts = 3;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    FileDescriptor file(::open(part.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
    if (file.get() < 0) {
      return system_error("create", part, errno);
    }
    if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
      break;
    }
    if (!same_file(file.get(), part)) {
      continue;  // renamed between the opening and the locking
    }
    if (::ftruncate(file.get(), 0) != 0) {
      return system_error("empty", part, errno);
    }
    return file;
  }
  return make_error(ErrorCode::Unavailable, fmt::format("{} is being written by another process", part.string()));
}

/// So that the rename outlasts a power cut. Not every file system can sync a folder; those that cannot say EINVAL.
int sync_folder(const std::filesystem::path& folder) {
  const FileDescriptor directory(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0) {
    return errno;
  }
  return ::fsync(directory.get()) == 0 || errno == EINVAL ? 0 : errno;
}

}  // namespace

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: it is no regular file", path.string()));
  }
  std::filesystem::path part(path.string() + ".part");
  Result<FileDescriptor> file = open_locked(part);
  if (!file) {
    return tl::unexpected<Error>(file.error());
  }
  return AtomicFile(path, std::move(part), std::move(*file));
}

AtomicFile::AtomicFile(std::filesystem::path path, std::filesystem::path part, FileDescriptor file)
    : path_(std::move(path)), part_(std::move(part)), file_(std::move(file)) {
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
  if (file_.get() >= 0) {
    ::unlink(part_.c_str());
  }
}

Status AtomicFile::write(std::span<const std::uint8_t> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    if (const Status flushed = flush(); !flushed) {
      return flushed;
    }
  }
  if (bytes.size() < kBufferBytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    return {};
  }
  if (const int error = write_all(file_.get(), bytes); error != 0) {
    return system_error("write", part_, error);
  }
  return {};
}

Status AtomicFile::flush() {
  if (const int error = write_all(file_.get(), buffer_); error != 0) {
    return system_error("write", part_, error);
  }
  buffer_.clear();
  return {};
}

Status AtomicFile::commit() {
  if (const Status flushed = flush(); !flushed) {
    return flushed;
  }
  if (::fsync(file_.get()) != 0) {
    return system_error("write", part_, errno);
  }
  // Renamed while the lock is held, so that the name `part_` is ours until then.
  if (std::rename(part_.c_str(), path_.c_str()) != 0) {
    return system_error("write", path_, errno);
  }
  const int close_error = file_.close();
  const int sync_error = close_error != 0 ? close_error : sync_folder(path_.parent_path());
  if (sync_error != 0) {
    return system_error("sync the folder of", path_, sync_error);
  }
  return {};
}

}  // namespace posed
