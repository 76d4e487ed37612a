#include "config/text_file.h"

#include <cerrno>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

namespace posed {

Result<std::string> read_text_file(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{64} * 1024;
  const auto fail = [&](std::string_view reason) {
    return make_error(ErrorCode::Io, fmt::format("{}: cannot be read: {}", path.string(), reason));
  };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    return fail("no such file");
  }
  if (error) {
    return fail(error.message());
  }
  if (status.type() != std::filesystem::file_type::regular) {
    return fail("not a regular file");
  }
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    return fail(std::generic_category().message(errno));
  }
  std::string text(kMaxBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) {
    return fail("input error");
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxBytes) {
    return fail(fmt::format("longer than {} bytes, so not a configuration", kMaxBytes));
  }
  return text;
}

}  // namespace posed
