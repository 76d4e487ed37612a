#include "core/file_io.h"

#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <string>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>
#include <sys/stat.h>

#include "core/file_descriptor.h"

namespace posed {

Status read_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes, std::size_t max_bytes) {
  // Without O_NONBLOCK, opening a named pipe that nobody writes to would wait for ever.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat info {};
  if (file.get() < 0 || ::fstat(file.get(), &info) != 0) {
    return system_error("open", path, errno);
  }
  if (!S_ISREG(info.st_mode)) {
    return make_error(ErrorCode::BadData, fmt::format("{} is not a regular file", path.string()));
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > max_bytes) {
    return make_error(ErrorCode::BadData, fmt::format("{} has {} bytes; at most {} are read", path.string(), size, max_bytes));
  }
  bytes.resize(size);
  std::size_t filled = 0;
  while (filled < size) {
    const ssize_t got = ::read(file.get(), bytes.data() + filled, size - filled);
    if (got < 0 && errno != EINTR) {
      return system_error("read", path, errno);
    }
    if (got == 0) {
      return make_error(ErrorCode::BadData,
                        fmt::format("{} shrank from {} to {} bytes while it was read", path.string(), size, filled));
    }
    filled += got > 0 ? static_cast<std::size_t>(got) : 0;
  }
  return {};
}

Status write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  std::error_code ignored;
  const bool in_place = std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored) &&
                        !std::filesystem::is_directory(path, ignored);
  const std::filesystem::path target = in_place ? path : std::filesystem::path(path.string() + ".part");
  int error = 0;
  {
    const int create = in_place ? 0 : O_CREAT | O_TRUNC;
    FileDescriptor file(::open(target.c_str(), O_WRONLY | O_CLOEXEC | create, 0666));
    if (file.get() < 0) {
      return system_error("create", target, errno);
    }
    error = write_all(file.get(), bytes);
    const int close_error = file.close();
    error = error != 0 ? error : close_error;
  }
  if (error == 0 && !in_place && std::rename(target.c_str(), path.c_str()) != 0) {
    error = errno;
  }
  if (error != 0) {
    if (!in_place) {
      ::unlink(target.c_str());
    }
    return system_error("write", path, error);
  }
  return {};
}

}  // namespace posed
