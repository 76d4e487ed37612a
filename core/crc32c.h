#pragma once

#include <cstdint>
#include <span>

namespace posed {

/// CRC-32C (Castagnoli; RFC 3720, appendix B.4) of `bytes`. For data in pieces, `before` is the checksum of what came before them.
/// Finds any error of up to 32 neighbouring bits. Reentrant.
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) noexcept;

}  // namespace posed
