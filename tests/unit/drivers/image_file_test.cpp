#include "drivers/image_file.h"

#include <algorithm>
#include <memory>
#include <spng.h>
#include <turbojpeg.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "drivers/image_writer.h"
#include "tests/support/test_recording.h"

namespace posed {
namespace {

using testing::HasSubstr;

/// A PNG of any kind; `pixels` in the file's own channels, packed.
std::vector<std::uint8_t> encode_png(spng_ihdr ihdr, const std::vector<std::uint8_t>& pixels) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  spng_set_ihdr(context.get(), &ihdr);
  if (ihdr.color_type == SPNG_COLOR_TYPE_INDEXED) {
    spng_plte palette{};
    palette.n_entries = 2;
    spng_set_plte(context.get(), &palette);
  }
  const int error = spng_encode_image(context.get(), pixels.data(), pixels.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
  EXPECT_EQ(error, 0) << spng_strerror(error);
  std::size_t size = 0;
  int buffer_error = 0;
  auto* file = static_cast<std::uint8_t*>(spng_get_png_buffer(context.get(), &size, &buffer_error));
  std::vector<std::uint8_t> bytes(file, file + size);
  std::free(file);
  return bytes;
}

std::vector<std::uint8_t> plain_png(std::uint8_t bits, std::uint8_t color_type, std::size_t bytes_a_pixel) {
  spng_ihdr ihdr{};
  ihdr.width = kTestWidth;
  ihdr.height = kTestHeight;
  ihdr.bit_depth = bits;
  ihdr.color_type = color_type;
  return encode_png(ihdr, std::vector<std::uint8_t>(kTestWidth * kTestHeight * bytes_a_pixel, 1));
}

std::vector<std::uint8_t> encode_jpeg(const std::vector<std::uint8_t>& pixels, int format, int subsampling, int flags) {
  tjhandle encoder = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(encoder, pixels.data(), kTestWidth, 0, kTestHeight, format, &bytes, &size, subsampling, 95, flags), 0)
      << tjGetErrorStr2(encoder);
  std::vector<std::uint8_t> file(bytes, bytes + size);
  tjFree(bytes);
  tjDestroy(encoder);
  return file;
}

class ImageFile : public testing::Test {
 protected:
  ImageFile() : pool_(kTestWidth, kTestHeight, 2), painted_(*pool_.acquire()), decoded_(*pool_.acquire()) { paint(*painted_, 3); }

  Status color(const std::vector<std::uint8_t>& file) { return decoder_.decode_color(file, decoded_->bgr, decoded_->gray); }
  Status depth(const std::vector<std::uint8_t>& file) { return decoder_.decode_depth(file, 5000.0, decoded_->depth_m); }
  std::filesystem::path path(const char* name) const { return folder_.path() / name; }

  std::vector<std::uint8_t> color_png() { return write_png_bgr8(path("c.png"), painted_->bgr), bytes_of(path("c.png")); }
  std::vector<std::uint8_t> depth_png() {
    return write_png_depth16(path("d.png"), painted_->depth_m, 5000.0), bytes_of(path("d.png"));
  }
  std::vector<std::uint8_t> color_jpeg() { return write_jpeg_bgr(path("c.jpg"), painted_->bgr, 95), bytes_of(path("c.jpg")); }

  TemporaryFolder folder_;
  FramePool pool_;
  FrameWriter painted_;
  FrameWriter decoded_;
  ImageDecoder decoder_;
};

template <typename T>
bool same_pixels(ImageView<T> a, ImageView<T> b) {
  for (int y = 0; y < a.height; ++y) {
    if (!std::equal(a.row(y), a.row(y) + a.width * a.channels, b.row(y))) {
      return false;
    }
  }
  return true;
}

std::string message(const Status& status) {
  return status ? "no error" : status.error().message;
}

TEST_F(ImageFile, PngColorAndDepthComeBackExactly) {
  ASSERT_EQ(message(color(color_png())), "no error");
  ASSERT_EQ(message(depth(depth_png())), "no error");
  EXPECT_TRUE(same_pixels(painted_->bgr, decoded_->bgr));
  EXPECT_TRUE(same_pixels(painted_->depth_m, decoded_->depth_m));
  const std::uint8_t* bgr = &painted_->bgr.at(20, 9);
  EXPECT_EQ(decoded_->gray.at(20, 9), (bgr[2] * 4899 + bgr[1] * 9617 + bgr[0] * 1868 + 8192) >> 14);
  EXPECT_EQ(decoded_->depth_m.at(0, 0), 0.0F);
}

TEST_F(ImageFile, JpegColorComesBackNearly) {
  ASSERT_EQ(message(color(color_jpeg())), "no error");
  int worst = 0;
  for (int y = 0; y < kTestHeight; ++y) {
    for (int i = 0; i < 3 * kTestWidth; ++i) {
      worst = std::max(worst, std::abs(decoded_->bgr.row(y)[i] - painted_->bgr.row(y)[i]));
    }
  }
  EXPECT_LE(worst, 8);
}

TEST_F(ImageFile, GreyColorImagesAreReplicated) {
  const std::vector<std::uint8_t> grey(kTestWidth * kTestHeight, 77);
  for (const auto& file : {plain_png(8, SPNG_COLOR_TYPE_GRAYSCALE, 1), encode_jpeg(grey, TJPF_GRAY, TJSAMP_GRAY, 0)}) {
    ASSERT_EQ(message(color(file)), "no error");
    const std::uint8_t* bgr = &decoded_->bgr.at(5, 5);
    EXPECT_EQ(bgr[0], bgr[1]);
    EXPECT_EQ(bgr[1], bgr[2]);
    EXPECT_EQ(decoded_->gray.at(5, 5), bgr[0]);
  }
  EXPECT_EQ(decoded_->gray.at(5, 5), 77);
}

TEST_F(ImageFile, InterlacedPngAndProgressiveJpegAreRead) {
  spng_ihdr ihdr{kTestWidth, kTestHeight, 16, SPNG_COLOR_TYPE_GRAYSCALE, 0, 0, SPNG_INTERLACE_ADAM7};
  EXPECT_EQ(message(depth(encode_png(ihdr, std::vector<std::uint8_t>(kTestWidth * kTestHeight * 2, 1)))), "no error");
  EXPECT_EQ(decoded_->depth_m.at(kTestWidth - 1, kTestHeight - 1), 257.0F / 5000.0F);
  const std::vector<std::uint8_t> pixels(3 * kTestWidth * kTestHeight, 50);
  EXPECT_EQ(message(color(encode_jpeg(pixels, TJPF_BGR, TJSAMP_420, TJFLAG_PROGRESSIVE))), "no error");
}

TEST_F(ImageFile, EveryTruncationIsAnError) {
  const auto whole_color = color_png();
  const auto whole_depth = depth_png();
  const auto whole_jpeg = color_jpeg();
  // libspng asks for the end chunk but not for its checksum: all pixels are there by then, and checked.
  constexpr std::size_t kEndChecksum = 4;
  for (std::size_t size = 0; size + kEndChecksum < whole_color.size(); ++size) {
    ASSERT_FALSE(color({whole_color.begin(), whole_color.begin() + static_cast<std::ptrdiff_t>(size)})) << size << " bytes";
  }
  for (std::size_t size = 0; size + kEndChecksum < whole_depth.size(); ++size) {
    ASSERT_FALSE(depth({whole_depth.begin(), whole_depth.begin() + static_cast<std::ptrdiff_t>(size)})) << size << " bytes";
  }
  for (std::size_t size = 0; size < whole_jpeg.size(); ++size) {
    const Status status = color({whole_jpeg.begin(), whole_jpeg.begin() + static_cast<std::ptrdiff_t>(size)});
    ASSERT_FALSE(status) << size << " of " << whole_jpeg.size() << " bytes";
    ASSERT_EQ(status.error().code, ErrorCode::BadData);
  }
  EXPECT_EQ(message(color(whole_jpeg)), "no error") << "a decoder goes on after errors";
  EXPECT_TRUE(color(whole_color));
}

TEST_F(ImageFile, EveryFlippedByteOfAPngIsAnError) {
  const auto whole = depth_png();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto corrupt = whole;
    corrupt[i] ^= 0x10;
    ASSERT_FALSE(depth(corrupt)) << "byte " << i << " of " << whole.size();
  }
}

TEST_F(ImageFile, CorruptJpegNeverCrashes) {
  const auto whole = color_jpeg();
  std::size_t errors = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto corrupt = whole;
    corrupt[i] ^= 0xff;
    errors += color(corrupt) ? 0 : 1;
  }
  EXPECT_GT(errors, whole.size() / 10) << "headers and markers at least are checked";
}

TEST_F(ImageFile, WrongSizeNamesBoth) {
  FramePool other(kTestWidth + 1, kTestHeight, 1);
  const FrameWriter frame = *other.acquire();
  const RgbdFrame& large = *const_cast<FrameWriter&>(frame);
  const std::string expected = "the image is 48x36 where 49x36 is expected";
  EXPECT_EQ(message(decoder_.decode_color(color_png(), large.bgr, large.gray)), expected);
  EXPECT_EQ(message(decoder_.decode_color(color_jpeg(), large.bgr, large.gray)), expected);
  EXPECT_EQ(message(decoder_.decode_depth(depth_png(), 5000.0, large.depth_m)), expected);
}

TEST_F(ImageFile, WrongKindsOfDepthAreNamed) {
  EXPECT_THAT(message(depth(plain_png(8, SPNG_COLOR_TYPE_GRAYSCALE, 1))),
              "a PNG of 8 bits, grey, where depth of 16 bits, grey, is expected");
  EXPECT_THAT(message(depth(plain_png(16, SPNG_COLOR_TYPE_TRUECOLOR, 6))), HasSubstr("16 bits, colour,"));
  EXPECT_THAT(message(depth(color_jpeg())), HasSubstr("not a PNG"));
}

TEST_F(ImageFile, WrongKindsOfColorAreNamed) {
  EXPECT_THAT(message(color(depth_png())), "a PNG of 16 bits, grey, where 8 bits, colour or grey, is expected");
  EXPECT_THAT(message(color(plain_png(8, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 4))), HasSubstr("colour with alpha"));
  EXPECT_THAT(message(color(plain_png(8, SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, 2))), HasSubstr("grey with alpha"));
  EXPECT_THAT(message(color(plain_png(8, SPNG_COLOR_TYPE_INDEXED, 1))), HasSubstr("palette"));
  const std::vector<std::uint8_t> inks(4 * kTestWidth * kTestHeight, 9);
  EXPECT_THAT(message(color(encode_jpeg(inks, TJPF_CMYK, TJSAMP_444, 0))), HasSubstr("CMYK"));
  EXPECT_THAT(message(color({'B', 'M', 1, 2})), "neither PNG nor JPEG");
  EXPECT_THAT(message(color({})), "the file is empty");
  EXPECT_THAT(message(depth({})), "the file is empty");
}

TEST_F(ImageFile, AHostileSizeIsRefusedBeforeAnythingIsAllocated) {
  auto huge = depth_png();
  huge[16] = 0x7f;  // first byte of the width, whose checksum is then wrong too
  EXPECT_FALSE(depth(huge));
  spng_ihdr ihdr{30000, 2, 16, SPNG_COLOR_TYPE_GRAYSCALE, 0, 0, 0};
  EXPECT_EQ(message(depth(encode_png(ihdr, std::vector<std::uint8_t>(30000 * 2 * 2)))),
            "the image is 30000x2 where 48x36 is expected");
}

TEST_F(ImageFile, FilesThatCannotBeReadAreNamed) {
  const Status missing = decoder_.read_color(path("none.png"), decoded_->bgr, decoded_->gray);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_THAT(message(missing), HasSubstr("none.png"));
  EXPECT_THAT(message(decoder_.read_depth(folder_.path(), 5000.0, decoded_->depth_m)), HasSubstr("not a regular file"));
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_THAT(message(decoder_.read_depth(path("pipe"), 5000.0, decoded_->depth_m)), HasSubstr("not a regular file"));
  write_text(path("text.png"), "hello");
  EXPECT_THAT(message(decoder_.read_color(path("text.png"), decoded_->bgr, decoded_->gray)), HasSubstr("text.png: neither PNG"));
}

TEST_F(ImageFile, HeadersSayWhatAFileIs) {
  ASSERT_FALSE(depth_png().empty());
  const Result<ImageHeader> png = decoder_.read_header(path("d.png"));
  ASSERT_TRUE(png);
  EXPECT_EQ(png->format, "PNG");
  EXPECT_EQ(png->bits, 16);
  EXPECT_EQ(png->channels, 1);
  const Result<ImageHeader> jpeg = decoder_.decode_header(color_jpeg());
  ASSERT_TRUE(jpeg);
  EXPECT_EQ(jpeg->format, "JPEG");
  EXPECT_EQ(jpeg->width, kTestWidth);
  EXPECT_EQ(jpeg->height, kTestHeight);
  EXPECT_EQ(jpeg->channels, 3);
  EXPECT_FALSE(decoder_.read_header(path("none.png")));
}

}  // namespace
}  // namespace posed
