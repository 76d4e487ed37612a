#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"

namespace posed {

/// The file that `name` stands for: itself where it is absolute, otherwise the first of `folders` and then `shipped` that has it.
/// Error code: Io, with the places that were tried. Reentrant.
Result<std::filesystem::path> find_file(const std::filesystem::path& name, std::vector<std::filesystem::path> folders,
                                        std::vector<std::filesystem::path> shipped);

}  // namespace posed
