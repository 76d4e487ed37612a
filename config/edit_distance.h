#pragma once

#include <cstddef>
#include <string_view>

namespace posed {

/// Fewest insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b` (optimal string alignment). Source:
/// Damerau, "A technique for computer detection and correction of spelling errors", CACM 7(3), 1964; recurrence of Wagner and
/// Fischer, JACM 21(1), 1974. Reentrant.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace posed
