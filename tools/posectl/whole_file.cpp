#include "tools/posectl/whole_file.h"

#include <cerrno>
#include <cstdint>
#include <span>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>

#include "core/file_io.h"

namespace posed {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

}  // namespace

Result<std::string> read_whole_file(const fs::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const Status status = read_file(path, bytes); !status) {
    return tl::unexpected<Error>(status.error());
  }
  return std::string(bytes.begin(), bytes.end());
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
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), std::generic_category().message(errno)));
  }
  return {};
}

Status write_whole_file(const fs::path& path, std::string_view contents) {
  return write_file(path, {reinterpret_cast<const std::uint8_t*>(contents.data()), contents.size()});
}

}  // namespace posed
