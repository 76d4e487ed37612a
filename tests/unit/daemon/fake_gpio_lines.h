#pragma once

#include <functional>
#include <vector>

#include "drivers/gpio_lines.h"

namespace posed {

/// Lines that a test sets, and a light that remembers its states. Thread-bound.
class FakeGpioLines final : public GpioLines {
 public:
  bool enabled_now = true;
  GpioHealth report;
  std::vector<LightState> shown;                                ///< changes alone
  std::function<void(LightState)> on_show = [](LightState) {};  ///< at every call

  void show(LightState state) noexcept override {
    if (shown.empty() || shown.back() != state) {
      shown.push_back(state);
    }
    on_show(state);
  }
  bool enabled() const noexcept override { return enabled_now; }
  GpioHealth health() const noexcept override { return report; }
};

}  // namespace posed
