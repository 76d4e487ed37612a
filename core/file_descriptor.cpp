#include "core/file_descriptor.h"

#include <string>
#include <system_error>

#include <fmt/format.h>

namespace posed {

tl::unexpected<Error> system_error(const char* action, const std::filesystem::path& path, int error) {
  const bool missing = error == ENOENT || error == ENOTDIR;
  std::string hint;
  if (error == ENOSPC || error == EDQUOT) {
    hint = "; free some space or choose another folder";
  }
  return make_error(missing ? ErrorCode::NotFound : ErrorCode::Io,
                    fmt::format("cannot {} {}: {}{}", action, path.string(), std::generic_category().message(error), hint));
}

int write_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      return errno;
    }
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }
  return 0;
}

}  // namespace posed
