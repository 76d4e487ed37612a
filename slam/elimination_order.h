#pragma once

#include <cstdint>
#include <vector>

#include "slam/block_cholesky.h"

namespace posed {

/// An order of a symmetric block matrix's columns in which its factor stays sparse: the n-th number is the column to be eliminated
/// n-th. Approximate minimum degree (Amestoy, Davis, Duff, SIAM J. Matrix Analysis 17(4), 1996), as Eigen implements it.
/// Deterministic. Reentrant.
std::vector<std::uint32_t> elimination_order(const BlockPattern& pattern);

}  // namespace posed
