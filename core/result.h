#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

/// How errors travel: `Result<T>` is a value or an `Error`. No exception crosses a folder's boundary; see docs/errors.md.
namespace posed {

enum class ErrorCode {
  InvalidArgument,  ///< the caller's or the user's value is outside of what is allowed
  InvalidConfig,    ///< a configuration or calibration file is wrong (the program exits with EX_CONFIG)
  NotFound,         ///< a file, device or sequence does not exist
  BadData,          ///< a file or device delivered something malformed (truncated image, broken list)
  Io,               ///< the operating system refused to read, write or open
  Unavailable,      ///< the resource exists but cannot serve now; trying again can help
  Unsupported,      ///< left out of this build, or asked of a device that cannot do it
};

/// What went wrong, worded for the person who must mend it: file, line, key and value where they exist.
struct Error {
  ErrorCode code = ErrorCode::InvalidArgument;
  std::string message;
};

template <typename T>
using Result = tl::expected<T, Error>;
using Status = Result<void>;

inline tl::unexpected<Error> make_error(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace posed
