#pragma once

#include "core/result.h"
#include "detect/network.h"

namespace posed {

/// The same function in fewer nodes: per-channel factors folded into the convolution before them, activations (also SiLU written as
/// x * sigmoid(x)) fused into it, the four slices of YOLOv5's stem as `SpaceToDepth`, the twenty nodes of an attention block as
/// `Cbam`, and what no output needs left out. Simplifying twice changes nothing; ranges are kept only where nothing changed.
/// Reentrant. Errors: those of `Network::create`.
Result<Network> simplify(const Network& network);

}  // namespace posed
