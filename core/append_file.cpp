#include "core/append_file.h"

#include <cerrno>
#include <cstdint>
#include <fcntl.h>
#include <utility>

#include <fmt/format.h>

namespace posed {

Result<AppendFile> AppendFile::create(const std::filesystem::path& path) {
  FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666));
  if (file.get() < 0 && errno == EEXIST) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("{} exists already", path.string()));
  }
  if (file.get() < 0) {
    return system_error("create", path, errno);
  }
  return AppendFile(path, std::move(file));
}

Status AppendFile::append(std::string_view text) {
  const int error = write_all(file_.get(), {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  if (error != 0) {
    // Cutting off cannot fail for want of space, and there is nothing better to do where it fails for another reason.
    [[maybe_unused]] const int ignored = ::ftruncate(file_.get(), bytes_);
    return system_error("write", path_, error);
  }
  bytes_ += static_cast<std::int64_t>(text.size());
  return {};
}

Status AppendFile::sync() {
  return ::fdatasync(file_.get()) == 0 ? Status() : Status(system_error("write", path_, errno));
}

}  // namespace posed
