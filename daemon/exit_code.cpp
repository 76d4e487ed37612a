#include "daemon/exit_code.h"

#include <sysexits.h>

namespace posed {

static_assert(EX_USAGE == 64 && EX_DATAERR == 65 && EX_NOINPUT == 66 && EX_UNAVAILABLE == 69 && EX_SOFTWARE == 70 &&
              EX_IOERR == 74 && EX_CONFIG == 78);

int exit_code(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::InvalidArgument: return EX_CONFIG;  // past the command line, every value comes from the configuration
    case ErrorCode::InvalidConfig: return EX_CONFIG;
    case ErrorCode::NotFound: return EX_NOINPUT;
    case ErrorCode::BadData: return EX_DATAERR;
    case ErrorCode::Io: return EX_IOERR;
    case ErrorCode::Unavailable: return EX_UNAVAILABLE;
    case ErrorCode::Unsupported: return EX_UNAVAILABLE;
  }
  return EX_SOFTWARE;
}

std::string_view exit_code_table() noexcept {
  return "Exit codes:\n"
         "   0  stopped by SIGINT or SIGTERM, or the source ended (--exit-at-end), or what was asked is printed\n"
         "  64  the command line is wrong\n"
         "  65  a file or device delivered something malformed\n"
         "  66  a sequence, file or device does not exist\n"
         "  69  a device or the system cannot serve now, or this build was made without it;\n"
         "      with --exit-at-end also: the source failed\n"
         "  70  an error inside the program: please report it\n"
         "  74  the operating system refused to read, write or open\n"
         "  78  the configuration is wrong (nothing was touched), or the map it names cannot be used";
}

}  // namespace posed
