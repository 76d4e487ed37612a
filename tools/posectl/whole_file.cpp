#include "tools/posectl/whole_file.h"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

namespace posed {
namespace {

namespace fs = std::filesystem;

std::string reason_of(int error_number) {
  return std::generic_category().message(error_number);
}

tl::unexpected<Error> system_error(std::string_view what, const fs::path& path, int error_number) {
  const ErrorCode code = error_number == ENOENT ? ErrorCode::NotFound : ErrorCode::Io;
  return make_error(code, fmt::format("cannot {} {}: {}", what, path.string(), reason_of(error_number)));
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  int get() const { return fd_; }
  int close() { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

Status write_all(FileDescriptor& file, const fs::path& path, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t written = ::write(file.get(), contents.data(), contents.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written < 0) {
      return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), reason_of(errno)));
    }
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  // Some file systems report a full disk only here.
  if (file.close() != 0) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), reason_of(errno)));
  }
  return {};
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

}  // namespace

Result<std::string> read_whole_file(const fs::path& path) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) {
    return system_error("open", path, errno);
  }
  std::string contents;
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      return system_error("read", path, errno);
    }
    if (count == 0) {
      return contents;
    }
    contents.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

Status check_writable(const fs::path& path) {
  std::error_code ignored;
  const fs::path folder = folder_of(path);
  if (!fs::is_directory(folder, ignored)) {
    return make_error(ErrorCode::Io,
                      fmt::format("cannot write {}: there is no folder {}; make it with mkdir -p", path.string(), folder.string()));
  }
  if (fs::is_directory(path, ignored)) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: it is a folder; name a file", path.string()));
  }
  const bool replaced_whole = !fs::exists(path, ignored) || fs::is_regular_file(path, ignored);
  if (::access(replaced_whole ? folder.c_str() : path.c_str(), W_OK) != 0) {
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), reason_of(errno)));
  }
  return {};
}

Status write_whole_file(const fs::path& path, std::string_view contents) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (file.get() < 0) {
      return make_error(ErrorCode::Io, fmt::format("cannot open {}: {}", path.string(), reason_of(errno)));
    }
    return write_all(file, path, contents);
  }
  fs::path temporary = path;
  temporary += fmt::format(".{}.part", ::getpid());
  FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) {
    return make_error(ErrorCode::Io, fmt::format("cannot create {}: {}", temporary.string(), reason_of(errno)));
  }
  Status status = write_all(file, temporary, contents);
  if (status && ::rename(temporary.c_str(), path.c_str()) != 0) {
    status =
        make_error(ErrorCode::Io, fmt::format("cannot rename {} to {}: {}", temporary.string(), path.string(), reason_of(errno)));
  }
  if (!status) {
    ::unlink(temporary.c_str());
  }
  return status;
}

}  // namespace posed
