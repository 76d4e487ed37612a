#include "drivers/gpio_lines.h"

#include <utility>

#ifdef POSED_HAS_GPIO
#include "drivers/gpio/gpio_thread.h"
#include "drivers/gpio/libgpiod_access.h"
#endif

namespace posed {

Result<std::unique_ptr<GpioLines>> make_gpio_lines([[maybe_unused]] const GpioConfig& config, [[maybe_unused]] ThreadOptions thread,
                                                   [[maybe_unused]] const Clock& clock,
                                                   [[maybe_unused]] std::function<void(const Error&)> on_error) {
#ifdef POSED_HAS_GPIO
  return make_gpio_thread(config, make_libgpiod_access(), std::move(thread), clock, std::move(on_error));
#else
  return make_error(ErrorCode::Unsupported,
                    "gpio.chip = \"" + config.chip + "\": this build was made without GPIO (CMake option POSED_GPIO)");
#endif
}

}  // namespace posed
