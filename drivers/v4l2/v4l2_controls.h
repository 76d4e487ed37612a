#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "drivers/v4l2/v4l2_device.h"

/// Settings of a camera by their names. Reentrant.
namespace posed {

/// A control's name as `v4l2-ctl -L` spells it: letters and digits, lower case, and an underscore for what lies between them:
/// "Exposure Time, Absolute" is exposure_time_absolute.
std::string control_word(const char* name);

/// Sets each of `settings` ("name=value"), in this order. A value is a whole number (0x for hexadecimal), true or false for a
/// switch, the number or the word of an entry for a menu. Unsupported names device, control, value and what is allowed; the
/// settings before it stay set.
Status set_controls(const V4l2Device& device, const std::vector<std::string>& settings);

}  // namespace posed
