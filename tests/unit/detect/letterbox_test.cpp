#include "detect/letterbox.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

/// An image with its own memory.
struct Image {
  Image(int width, int height)
      : pixels(static_cast<std::size_t>(width * height) * 3), view{pixels.data(), width, height, 3L * width, 3} {}
  std::vector<std::uint8_t> pixels;
  ImageView<std::uint8_t> view;
};

std::vector<float> placed(Letterbox& letterbox, const Image& image, TensorShape input) {
  std::vector<float> planes(input.size(), -1.0F);
  letterbox.place(image.view, planes);
  return planes;
}

TEST(Letterbox, KeepsTheProportionsAndSwapsToRgb) {
  // Four by two, blue on the left and red on the right, into a square: two rows of border above and below.
  Image image(4, 2);
  for (std::size_t pixel = 0; pixel < 8; ++pixel) {
    image.pixels[3 * pixel + (pixel % 4 < 2 ? 0 : 2)] = 255;
  }
  const TensorShape input{3, 8, 8};
  Letterbox letterbox(input, {});
  const std::vector<float> planes = placed(letterbox, image, input);
  const auto at = [&](std::size_t channel, std::size_t y, std::size_t x) { return planes[(channel * 8 + y) * 8 + x]; };
  for (std::size_t channel = 0; channel < 3; ++channel) {
    EXPECT_FLOAT_EQ(at(channel, 1, 4), 114.0F / 255);
    EXPECT_FLOAT_EQ(at(channel, 6, 4), 114.0F / 255);
    EXPECT_FLOAT_EQ(at(channel, 3, 0), channel == 2 ? 1 : 0);
    EXPECT_FLOAT_EQ(at(channel, 4, 7), channel == 0 ? 1 : 0);
  }
  // Half of the way from blue to red lies between columns 3 and 4.
  EXPECT_FLOAT_EQ(at(0, 3, 3) + at(0, 3, 4), 1);
}

TEST(Letterbox, ShrinkingAveragesEveryPixelOnce) {
  Image image(12, 8);
  std::mt19937 random(1);
  std::generate(image.pixels.begin(), image.pixels.end(), [&] { return static_cast<std::uint8_t>(random() & 0xFFU); });
  const TensorShape input{3, 2, 3};  // a fourth of it
  Letterbox letterbox(input, {true, 1.0F, 0});
  const std::vector<float> planes = placed(letterbox, image, input);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      float sum = 0;
      for (int v = 0; v < 4; ++v) {
        for (int u = 0; u < 4; ++u) {
          sum += static_cast<float>((&image.view.at(4 * x + u, 4 * y + v))[1]);
        }
      }
      EXPECT_NEAR(planes[static_cast<std::size_t>(6 + 3 * y + x)], sum / 16, 1e-3F) << x << ", " << y;
    }
  }
}

TEST(Letterbox, AFlatImageStaysFlatAtAnySize) {
  for (const auto& [width, height] : {std::pair{640, 480}, {641, 479}, {97, 53}, {1, 1}, {3, 700}}) {
    Image image(width, height);
    std::fill(image.pixels.begin(), image.pixels.end(), std::uint8_t{200});
    const TensorShape input{3, 64, 96};
    Letterbox letterbox(input, {true, 1.0F, 200});
    const std::vector<float> planes = placed(letterbox, image, input);
    const auto [low, high] = std::minmax_element(planes.begin(), planes.end());
    EXPECT_NEAR(*low, 200, 1e-2F) << width << "x" << height;
    EXPECT_NEAR(*high, 200, 1e-2F) << width << "x" << height;
  }
}

TEST(Letterbox, BoxesComeBackToTheImage) {
  Image image(640, 480);
  const TensorShape input{3, 256, 320};
  Letterbox letterbox(input, {});
  placed(letterbox, image, input);
  // 640x480 becomes 320x240 with 8 rows of border above: the whole image, and one pixel's worth of it.
  EXPECT_EQ(letterbox.to_image({0, 8, 320, 248}), (BoundingBox{-0.5F, -0.5F, 639.5F, 479.5F}));
  EXPECT_EQ(letterbox.to_image({10, 18, 20, 28}), (BoundingBox{19.5F, 19.5F, 39.5F, 39.5F}));
  EXPECT_EQ(letterbox.to_image({-50, -50, 900, 900}), (BoundingBox{-0.5F, -0.5F, 639.5F, 479.5F})) << "cut to the image";
}

TEST(Letterbox, FollowsAChangeOfTheImagesSize) {
  const TensorShape input{3, 32, 32};
  Letterbox letterbox(input, {true, 1.0F, 0});
  Image wide(64, 16);
  std::fill(wide.pixels.begin(), wide.pixels.end(), std::uint8_t{100});
  Image square(40, 40);
  std::fill(square.pixels.begin(), square.pixels.end(), std::uint8_t{50});
  EXPECT_NEAR(placed(letterbox, wide, input)[0], 0, 1e-4F) << "border above";
  EXPECT_NEAR(placed(letterbox, square, input)[0], 50, 1e-3F);
  EXPECT_NEAR(placed(letterbox, wide, input)[16 * 32], 100, 1e-3F);
}

}  // namespace
}  // namespace posed
