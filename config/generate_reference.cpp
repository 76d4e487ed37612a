// Writes what is generated from the configuration's schema into the source tree.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "config/config_reference.h"

namespace {

bool write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    std::fprintf(stderr, "%s: cannot be written\n", path.c_str());
    return false;
  }
  std::printf("%s\n", path.c_str());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || !std::filesystem::is_regular_file(std::filesystem::path(argv[1]) / "config" / "config_schema.cpp")) {
    std::fprintf(stderr, "usage: %s SOURCE_TREE\nwrites docs/configuration.md and config/posed.toml there\n", argv[0]);
    return 64;  // EX_USAGE
  }
  const std::filesystem::path root = argv[1];
  std::filesystem::create_directories(root / "docs");
  const bool written = write(root / "docs" / "configuration.md", posed::configuration_reference()) &&
                       write(root / "config" / "posed.toml", posed::example_configuration());
  return written ? 0 : 1;
}
