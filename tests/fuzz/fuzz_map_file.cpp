// A map file is loaded or refused with a message that names it, and what is loaded is saved and loaded again byte by byte the same.
// Input that begins as a map file does is one; any other is a list of changes (record, position, byte) to the records of a small
// map, whose checksums are then mended, so that the checks of the values behind them are reached.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

#include "slam/map_io.h"
#include "tests/support/map_file_bytes.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace posed;

void expect(bool holds, const char* what, const std::string& detail) {
  if (!holds) {
    std::fprintf(stderr, "%s\n%s\n", what, detail.c_str());
    std::abort();
  }
}

std::string small_map(const TemporaryFolder& folder) {
  const Status saved = save_map(folder / "small", random_map(1, 6, 5), random_map_header());
  expect(saved.has_value(), "the small map cannot be saved", saved ? "" : saved.error().message);
  return contents_of(folder / "small");
}

std::string changed(MapFileBytes file, const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kChangeBytes = 4;
  for (std::size_t i = 0; i + kChangeBytes <= size; i += kChangeBytes) {
    std::string& payload = file.records()[data[i] % file.records().size()].payload;
    const std::size_t position = (std::size_t{data[i + 1]} << 8 | data[i + 2]) % payload.size();
    payload[position] = static_cast<char>(data[i + 3]);
  }
  return file.bytes();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder folder;
  static const MapFileBytes small(small_map(folder));
  static const std::string path = folder / "map";

  const std::string input(reinterpret_cast<const char*>(data), size);
  const std::string bytes = input.starts_with("POSEDMAP") ? input : changed(small, data, size);
  std::ofstream(path, std::ios::binary) << bytes;
  const Result<LoadedMap> loaded = load_map(path, random_map_header());
  if (!loaded) {
    expect(loaded.error().message.starts_with(path), "a message does not begin with the file's name", loaded.error().message);
    return 0;
  }
  const std::string again = folder / "again";
  const Status saved = save_map(again, loaded->map, loaded->header);
  expect(saved.has_value(), "what was loaded cannot be saved", saved ? "" : saved.error().message);
  expect(contents_of(again) == bytes, "what was loaded is saved differently", "");
  return 0;
}
