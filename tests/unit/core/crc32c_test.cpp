#include "core/crc32c.h"

#include <array>
#include <numeric>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// The examples of RFC 3720, appendix B.4, and the customary check value.
TEST(Crc32c, AgreesWithThePublishedExamples) {
  std::array<std::uint8_t, 32> data{};
  EXPECT_EQ(crc32c(data), 0x8A9136AAU);
  data.fill(0xFF);
  EXPECT_EQ(crc32c(data), 0x62A8AB43U);
  std::iota(data.begin(), data.end(), std::uint8_t{0});
  EXPECT_EQ(crc32c(data), 0x46DD794EU);
  std::iota(data.rbegin(), data.rend(), std::uint8_t{0});
  EXPECT_EQ(crc32c(data), 0x113FDB5CU);
  EXPECT_EQ(crc32c(bytes_of("123456789")), 0xE3069283U);
  EXPECT_EQ(crc32c({}), 0U);
}

TEST(Crc32c, GoesOnFromPieceToPiece) {
  const std::string_view text = "123456789";
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    EXPECT_EQ(crc32c(bytes_of(text.substr(cut)), crc32c(bytes_of(text.substr(0, cut)))), 0xE3069283U) << cut;
  }
}

}  // namespace
}  // namespace posed
