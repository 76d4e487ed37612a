// Any bytes, read as ONNX and as the runner's own network file: accepted or refused with a message, without a crash. Bytes that do
// not begin as such a file are made its body, with a header of either version and a checksum around them, so that what lies behind
// those is reached.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/crc32c.h"
#include "detect/network_file.h"
#include "detect/network_passes.h"
#include "detect/onnx_reader.h"

namespace {

using namespace posed;

void append(std::vector<std::uint8_t>& file, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    file.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

std::vector<std::uint8_t> with_header(std::span<const std::uint8_t> body, std::uint32_t version) {
  const std::string magic = "POSEDNET";
  std::vector<std::uint8_t> file(magic.begin(), magic.end());
  append(file, version, 4);
  append(file, body.size(), 8);
  file.insert(file.end(), body.begin(), body.end());
  append(file, crc32c(file), 4);
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const bool is_whole = std::string(data, data + size).starts_with("POSEDNET");
  for (std::uint32_t version = is_whole ? kNetworkFormatVersion : kOldestNetworkFormatVersion; version <= kNetworkFormatVersion;
       ++version) {
    const std::vector<std::uint8_t> file = is_whole ? std::vector<std::uint8_t>(data, data + size) : with_header(bytes, version);
    if (const Result<Network> network = parse_network(file, "fuzz.posednet")) {
      (void)simplify(*network);
    }
  }
  if (const Result<Network> network = parse_onnx(bytes, "fuzz.onnx")) {
    (void)simplify(*network);
  }
  return 0;
}
