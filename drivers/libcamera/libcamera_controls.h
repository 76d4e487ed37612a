#pragma once

#include <string>
#include <vector>

#include <libcamera/controls.h>

#include "core/clock.h"
#include "core/result.h"

namespace posed {

/// The settings ("NAME=VALUE", libcamera's names) as a camera takes them at its start, checked against what it has: whole numbers,
/// decimal numbers, true or false. Unsupported names control, value and what is allowed. Reentrant.
Result<libcamera::ControlList> parse_controls(const libcamera::ControlInfoMap& known, const std::vector<std::string>& settings);

/// Asks for one image each `period_ns`, or the nearest that the camera has, where it can be asked; what was agreed.
TimeNs set_frame_period(const libcamera::ControlInfoMap& known, TimeNs period_ns, libcamera::ControlList& controls);

}  // namespace posed
