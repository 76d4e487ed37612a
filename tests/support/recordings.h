#pragma once

#include <cstdlib>
#include <filesystem>

namespace posed {

/// Folder of the real recording `name`: in $POSED_TEST_DATA, else where a checkout has test data beside it. Tests that need one
/// skip where its rgb.txt does not exist.
inline std::filesystem::path recording_folder(const char* name) {
  const char* data = std::getenv("POSED_TEST_DATA");
  const std::filesystem::path folder =
      data != nullptr ? std::filesystem::path(data) : std::filesystem::path(POSED_SOURCE_DIR) / "../shared/data";
  return folder / name;
}

}  // namespace posed
