#include "drivers/libcamera/color_image.h"

#include <memory>
#include <turbojpeg.h>
#include <vector>

#include <gtest/gtest.h>

#include "core/frame_pool.h"

namespace posed {
namespace {

constexpr int kWidth = 4;
constexpr int kHeight = 2;

class ColorImageTest : public ::testing::Test {
 protected:
  Status write(const ColorFormat& format, const std::vector<std::uint8_t>& first, const std::vector<std::uint8_t>& second = {}) {
    EXPECT_GE(first.size(), least_first_bytes(format));
    EXPECT_GE(second.size(), least_second_bytes(format));
    return write_color(format, {first, second}, first.size(), mjpeg_, *frame_);
  }

  std::vector<int> pixel(int x, int y) {
    const std::uint8_t* const bgr = frame_->bgr.row(y) + 3 * x;
    return {bgr[0], bgr[1], bgr[2], frame_->gray.row(y)[x]};
  }

  MjpegDecoder mjpeg_;
  FramePool pool_{kWidth, kHeight, 1};
  FrameWriter frame_ = *pool_.acquire();
};

/// Rows of `stride` bytes whose padding is 77; the last one ends without it.
std::vector<std::uint8_t> rows(std::vector<std::vector<std::uint8_t>> lines, std::size_t stride) {
  std::vector<std::uint8_t> bytes;
  for (std::vector<std::uint8_t>& line : lines) {
    bytes.resize((bytes.size() + stride - 1) / stride * stride, 77);
    bytes.insert(bytes.end(), line.begin(), line.end());
  }
  return bytes;
}

TEST_F(ColorImageTest, ReadsBothOrdersOfColoursAndPassesOverPadding) {
  const auto image = rows({{10, 20, 30, 1, 1, 1, 2, 2, 2, 40, 50, 60}, {70, 80, 90, 3, 3, 3, 4, 4, 4, 100, 110, 120}}, 15);
  ASSERT_TRUE(write({ColorLayout::Bgr, kWidth, kHeight, 15, {}}, image));
  EXPECT_EQ(pixel(0, 0), (std::vector<int>{10, 20, 30, 22}));  // 0.299 * 30 + 0.587 * 20 + 0.114 * 10
  EXPECT_EQ(pixel(3, 1), (std::vector<int>{100, 110, 120, 112}));
  ASSERT_TRUE(write({ColorLayout::Rgb, kWidth, kHeight, 15, {}}, image));
  EXPECT_EQ(pixel(0, 0), (std::vector<int>{30, 20, 10, 18}));
  EXPECT_EQ(pixel(3, 1), (std::vector<int>{120, 110, 100, 108}));
}

TEST_F(ColorImageTest, ReadsYuv) {
  const YuvCoding full{YuvMatrix::Bt601, YuvRange::Full};
  const auto yuyv = rows({{10, 128, 20, 128, 30, 128, 40, 128}, {50, 128, 60, 128, 70, 128, 80, 128}}, 12);
  ASSERT_TRUE(write({ColorLayout::Yuyv, kWidth, kHeight, 12, full}, yuyv));
  EXPECT_EQ(pixel(1, 0), (std::vector<int>{20, 20, 20, 20}));
  EXPECT_EQ(pixel(3, 1), (std::vector<int>{80, 80, 80, 80}));

  const auto luma = rows({{10, 20, 30, 40}, {50, 60, 70, 80}}, 6);
  ASSERT_TRUE(write({ColorLayout::Nv12, kWidth, kHeight, 6, full}, luma, {128, 128, 128, 228}));
  EXPECT_EQ(pixel(1, 1), (std::vector<int>{60, 60, 60, 60}));
  EXPECT_EQ(pixel(3, 1)[3], 80);
  EXPECT_GT(pixel(3, 1)[2], 200) << "V of 228 is red";
}

TEST_F(ColorImageTest, ReadsJpegAndSaysWhereItIsDamaged) {
  const std::vector<std::uint8_t> gray(kWidth * kHeight * 3, 90);
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  ASSERT_EQ(tjCompress2(encoder.get(), gray.data(), kWidth, 0, kHeight, TJPF_BGR, &jpeg, &size, TJSAMP_444, 100, 0), 0);
  std::vector<std::uint8_t> image(jpeg, jpeg + size);
  tjFree(jpeg);
  const ColorFormat format{ColorLayout::Mjpeg, kWidth, kHeight, 0, {}};
  ASSERT_TRUE(write(format, image));
  EXPECT_NEAR(pixel(2, 1)[1], 90, 2);
  EXPECT_NEAR(pixel(2, 1)[3], 90, 2);

  const Status damaged = write_color(format, {image, {}}, 40, mjpeg_, *frame_);
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().code, ErrorCode::BadData);
}

}  // namespace
}  // namespace posed
