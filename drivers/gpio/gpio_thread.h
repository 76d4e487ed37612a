#pragma once

#include <functional>
#include <memory>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "core/thread.h"
#include "drivers/gpio/line_access.h"
#include "drivers/gpio_lines.h"

namespace posed {

/// `make_gpio_lines` with an access of the caller's choice. Error: Unavailable, where the system has no descriptor or thread left.
Result<std::unique_ptr<GpioLines>> make_gpio_thread(const GpioConfig& config, std::unique_ptr<LineAccess> access,
                                                    ThreadOptions thread, const Clock& clock,
                                                    std::function<void(const Error&)> on_error);

}  // namespace posed
