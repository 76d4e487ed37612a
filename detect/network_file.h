#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/result.h"
#include "detect/network.h"

/// The runner's own file, `NAME.posednet`: small, quick to load, and checked. Numbers are little-endian.
///
///     file     = "POSEDNET", format version (4 bytes), size of the body (8), body, CRC-32C of all before it (4)
///
/// The body is the simplified network (detect/network_passes.h) in the order of `Network`'s members; detect/network_file.cpp has
/// it. Weights are kept as 32-bit or 16-bit floats, or as 8-bit integers with a scale each output channel; biases always as 32-bit
/// floats.
namespace posed {

constexpr std::uint32_t kOldestNetworkFormatVersion = 1;  ///< that is read; it knows one box an anchor
constexpr std::uint32_t kNetworkFormatVersion = 2;

enum class WeightFormat : std::uint8_t { Float32 = 0, Float16 = 1, Int8 = 2 };

/// Errors as in AtomicFile; InvalidArgument where a weight is too large for the format.
Status write_network(const Network& network, WeightFormat format, const std::filesystem::path& path);

/// Errors: NotFound; Io; BadData: foreign, truncated, corrupt or not sound; Unsupported: written by a newer posed. Reentrant.
Result<Network> read_network(const std::filesystem::path& path);

/// The same of a file in memory; `source` names it in messages.
Result<Network> parse_network(std::span<const std::uint8_t> bytes, const std::string& source);

/// Whether a file's bytes begin as one of these.
bool is_network_file(std::span<const std::uint8_t> bytes);

}  // namespace posed
