#pragma once

#include <string>
#include <vector>

#include "core/result.h"

namespace posed {

/// One line of a chip; its offset is its place in ListedGpioChip::lines.
struct ListedGpioLine {
  std::string name;      ///< as the board's description calls it; empty: it has none
  std::string consumer;  ///< who has it; empty: nobody, or somebody without a name
  bool used = false;
};

struct ListedGpioChip {
  std::string name;   ///< "gpiochip0"
  std::string label;  ///< of the driver
  std::vector<ListedGpioLine> lines;
};

/// The GPIO chips of this machine; none is no error. Only in builds with GPIO (POSED_HAS_GPIO). Error: Io, where one cannot be
/// opened. Reentrant.
Result<std::vector<ListedGpioChip>> list_gpio_chips();

}  // namespace posed
