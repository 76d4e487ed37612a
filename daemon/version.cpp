#include "daemon/version.h"

namespace posed {

std::string_view version() noexcept {
  return POSED_VERSION;
}

}  // namespace posed
