#include "core/image_view.h"

#include <array>
#include <cstdint>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(ImageView, IsEmptyWithoutPixels) {
  const ImageView<std::uint8_t> view;
  EXPECT_TRUE(view.empty());
  EXPECT_FALSE(view.contains(0, 0));
}

TEST(ImageView, FindsPixelsByStrideAndChannels) {
  std::array<std::uint8_t, 16> pixels{};
  const ImageView<std::uint8_t> view{pixels.data(), 2, 2, 8, 3};  // two pixels of three channels, two elements of padding
  view.at(1, 1) = 7;
  EXPECT_EQ(pixels[8 + 3], 7);
  EXPECT_EQ(view.row(1), pixels.data() + 8);

  const ImageView<const std::uint8_t> read_only = view;
  EXPECT_EQ(read_only.at(1, 1), 7);
  EXPECT_FALSE(read_only.empty());
}

TEST(ImageView, ContainsItsPixelsAlone) {
  std::array<float, 6> pixels{};
  const ImageView<float> view{pixels.data(), 3, 2, 3, 1};
  EXPECT_TRUE(view.contains(0, 0));
  EXPECT_TRUE(view.contains(2, 1));
  EXPECT_FALSE(view.contains(3, 1));
  EXPECT_FALSE(view.contains(2, 2));
  EXPECT_FALSE(view.contains(-1, 0));
  EXPECT_FALSE(view.contains(0, -1));
}

}  // namespace
}  // namespace posed
