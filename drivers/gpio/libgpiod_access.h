#pragma once

#include <memory>

#include "drivers/gpio/line_access.h"

namespace posed {

/// The chips of this machine, through libgpiod 1. Each line has its chip opened for itself, so that one that fails takes no other
/// with it.
std::unique_ptr<LineAccess> make_libgpiod_access();

}  // namespace posed
