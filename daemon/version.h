#pragma once

#include <string_view>

namespace posed {

/// The project's version, as in "0.1.0". Reentrant.
std::string_view version() noexcept;

}  // namespace posed
