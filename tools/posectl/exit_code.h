#pragma once

#include "core/result.h"

namespace posed {

/// What `posectl` returns to the shell, after sysexits.h. `--help` and docs/posectl.md list the same codes.
enum ExitCode : int {
  kExitOk = 0,
  kExitNegative = 1,      ///< the program ran and the answer is no: nothing was tracked, messages are missing
  kExitUsage = 64,        ///< EX_USAGE: the command line is wrong
  kExitBadData = 65,      ///< EX_DATAERR: an input is malformed
  kExitNoInput = 66,      ///< EX_NOINPUT: an input does not exist
  kExitUnavailable = 69,  ///< EX_UNAVAILABLE: a service or a part of this build is missing
  kExitIo = 74,           ///< EX_IOERR: the system refused to read or write
  kExitConfig = 78,       ///< EX_CONFIG: a configuration or calibration file is wrong
};

/// The exit code that stands for an error. Reentrant.
constexpr ExitCode exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument: return kExitUsage;
    case ErrorCode::InvalidConfig: return kExitConfig;
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::BadData: return kExitBadData;
    case ErrorCode::Io: return kExitIo;
    case ErrorCode::Unavailable: return kExitUnavailable;
    case ErrorCode::Unsupported: return kExitUnavailable;
  }
  return kExitNegative;
}

}  // namespace posed
