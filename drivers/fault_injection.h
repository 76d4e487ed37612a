#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/rgbd_source.h"

/// Faults of a camera, put into the frames of a recording or of the rendered world, to see what becomes of them. Behind the faults
/// stands the same FrameGuard as behind a camera.
namespace posed {

enum class FaultKind {
  Drop,       ///< the frame is lost
  Thin,       ///< all but every `amount`-th frame are lost
  Duplicate,  ///< the frame comes twice
  Freeze,     ///< the image of the frame before the fault is repeated, with new stamps
  Black,      ///< colour is black, depth is there
  White,      ///< colour is overexposed, depth is there
  ZeroDepth,  ///< no depth
  NanDepth,   ///< depth is not a number
  Half,       ///< the lower half of colour and depth is missing
  Stamp,      ///< the capture stamp is off by `amount` seconds
};

struct Fault {
  FaultKind kind = FaultKind::Drop;
  std::uint64_t first = 0;  ///< frames of the source, both included
  std::uint64_t last = 0;
  double amount = 0;
};

/// "black 120-150", "stamp 60-60 -0.5", "thin 0-300 3": kind, frames, and an amount where the kind has one. Error InvalidArgument.
/// Reentrant.
Result<Fault> parse_fault(std::string_view text);

/// `source` with the faults. `clock` must outlive it.
std::unique_ptr<RgbdSource> with_faults(std::unique_ptr<RgbdSource> source, std::vector<Fault> faults, const Clock& clock);

}  // namespace posed
