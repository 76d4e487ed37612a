#include <cmath>
#include <cstring>
#include <optional>
#include <turbojpeg.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/v4l2_rig.h"

namespace posed::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kRounding = 0.54;  // to a whole number, and 13 bits of the coefficients

/// Reference of one pixel, in floating point: ITU-R BT.601 or BT.709.
struct Rgb {
  double r, g, b, luma;
};
Rgb reference(int y, int u, int v, bool bt709, bool full) {
  const double red = bt709 ? 0.2126 : 0.299;
  const double blue = bt709 ? 0.0722 : 0.114;
  const double luma = full ? y : (y - 16) * 255.0 / 219.0;
  const double chroma = full ? 1.0 : 255.0 / 224.0;
  const double cb = (u - 128) * chroma;
  const double cr = (v - 128) * chroma;
  const auto clip = [](double value) { return std::min(255.0, std::max(0.0, value)); };
  const double r = luma + 2.0 * (1.0 - red) * cr;
  const double b = luma + 2.0 * (1.0 - blue) * cb;
  const double g = (luma - red * r - blue * b) / (1.0 - red - blue);
  return {clip(r), clip(g), clip(b), clip(luma)};
}

std::uint8_t noise(std::uint64_t sequence, std::size_t i) {
  return static_cast<std::uint8_t>((sequence * 131 + i * 2654435761U) >> 7);
}

class V4l2Formats : public testing::Test, public V4l2Rig {
 protected:
  V4l2Formats() : pool_(kRigWidth, kRigHeight, 2) {
    color_->paint = [this](std::uint64_t sequence, const v4l2_pix_format& format, std::vector<std::uint8_t>& image) {
      for (std::size_t i = 0; i < image.size(); ++i) {
        image[i] = noise(sequence, i);
      }
      painted_ = image;
      format_ = format;
    };
  }

  void offer(std::uint32_t fourcc, std::uint32_t padding) { color_->formats = {{fourcc, {{640, 480}, kRigSize}, padding}}; }

  /// One frame, which must come.
  void read() {
    camera_ = camera();
    const Status opened = camera_->open();
    ASSERT_TRUE(opened) << opened.error().message;
    writer_.emplace(pool_.acquire().value());
    const CameraRead got = camera_->read(&**writer_, kNsPerSecond);
    ASSERT_EQ(got.kind, CameraReadKind::Frame) << got.error.message;
    EXPECT_THAT(kernel_.violations(), IsEmpty());
  }

  int at(std::size_t offset) const { return painted_[offset]; }

  void expect_pixel(int x, int y, const Rgb& expected) const {
    const RgbdFrame& frame = *const_cast<FrameWriter&>(*writer_);
    EXPECT_NEAR(frame.bgr.row(y)[3 * x], expected.b, kRounding) << "blue of " << x << ", " << y;
    EXPECT_NEAR(frame.bgr.row(y)[3 * x + 1], expected.g, kRounding) << "green of " << x << ", " << y;
    EXPECT_NEAR(frame.bgr.row(y)[3 * x + 2], expected.r, kRounding) << "red of " << x << ", " << y;
    EXPECT_NEAR(frame.gray.row(y)[x], expected.luma, kRounding) << "grey of " << x << ", " << y;
  }

  std::string refusal() {
    camera_ = camera();
    const Status opened = camera_->open();
    EXPECT_FALSE(opened);
    EXPECT_EQ(kernel_.open_descriptors(), 0U);
    EXPECT_EQ(kernel_.mappings(), 0U);
    EXPECT_THAT(kernel_.violations(), IsEmpty());
    return opened ? std::string() : opened.error().message;
  }

  FramePool pool_;
  std::unique_ptr<V4l2Camera> camera_;
  std::optional<FrameWriter> writer_;
  std::vector<std::uint8_t> painted_;
  v4l2_pix_format format_{};
};

struct Coding {
  std::uint32_t colorspace, encoding, quantization;
  bool bt709, full;
};

class V4l2YuvFormats : public V4l2Formats, public testing::WithParamInterface<Coding> {
 protected:
  void code() {
    color_->twist_format = [](v4l2_pix_format& pix) {
      pix.colorspace = GetParam().colorspace;
      pix.ycbcr_enc = GetParam().encoding;
      pix.quantization = GetParam().quantization;
    };
  }
};

TEST_P(V4l2YuvFormats, Yuyv) {
  offer(V4L2_PIX_FMT_YUYV, 6);
  code();
  read();
  for (int y = 0; y < kRigHeight; ++y) {
    for (int x = 0; x < kRigWidth; ++x) {
      const std::size_t row = static_cast<std::size_t>(y) * format_.bytesperline;
      const std::size_t pair = row + static_cast<std::size_t>(x / 2 * 4);
      expect_pixel(
          x, y,
          reference(at(row + static_cast<std::size_t>(2 * x)), at(pair + 1), at(pair + 3), GetParam().bt709, GetParam().full));
    }
  }
}

TEST_P(V4l2YuvFormats, Nv12) {
  offer(V4L2_PIX_FMT_NV12, 10);
  code();
  read();
  for (int y = 0; y < kRigHeight; ++y) {
    for (int x = 0; x < kRigWidth; ++x) {
      const std::size_t luma = static_cast<std::size_t>(y) * format_.bytesperline + static_cast<std::size_t>(x);
      const std::size_t chroma =
          static_cast<std::size_t>(kRigHeight + y / 2) * format_.bytesperline + static_cast<std::size_t>(x / 2 * 2);
      expect_pixel(x, y, reference(at(luma), at(chroma), at(chroma + 1), GetParam().bt709, GetParam().full));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Codings, V4l2YuvFormats,
    testing::Values(Coding{V4L2_COLORSPACE_SRGB, V4L2_YCBCR_ENC_DEFAULT, V4L2_QUANTIZATION_DEFAULT, false, false},
                    Coding{V4L2_COLORSPACE_JPEG, V4L2_YCBCR_ENC_DEFAULT, V4L2_QUANTIZATION_DEFAULT, false, true},
                    Coding{V4L2_COLORSPACE_REC709, V4L2_YCBCR_ENC_DEFAULT, V4L2_QUANTIZATION_DEFAULT, true, false},
                    Coding{V4L2_COLORSPACE_SRGB, V4L2_YCBCR_ENC_709, V4L2_QUANTIZATION_FULL_RANGE, true, true}));

TEST_F(V4l2Formats, Rgb24AndBgr24) {
  for (const bool rgb : {true, false}) {
    offer(rgb ? V4L2_PIX_FMT_RGB24 : V4L2_PIX_FMT_BGR24, 5);
    writer_.reset();
    read();
    for (int y = 0; y < kRigHeight; ++y) {
      for (int x = 0; x < kRigWidth; ++x) {
        const std::size_t pixel = static_cast<std::size_t>(y) * format_.bytesperline + static_cast<std::size_t>(3 * x);
        const double r = at(pixel + (rgb ? 0 : 2));
        const double g = at(pixel + 1);
        const double b = at(pixel + (rgb ? 2 : 0));
        expect_pixel(x, y, {r, g, b, 0.299 * r + 0.587 * g + 0.114 * b});
      }
    }
  }
}

TEST_F(V4l2Formats, Grey) {
  offer(V4L2_PIX_FMT_GREY, 3);
  read();
  for (int y = 0; y < kRigHeight; ++y) {
    for (int x = 0; x < kRigWidth; ++x) {
      const double grey = at(static_cast<std::size_t>(y) * format_.bytesperline + static_cast<std::size_t>(x));
      expect_pixel(x, y, {grey, grey, grey, grey});
    }
  }
}

TEST_F(V4l2Formats, DepthInMetresOfBothFormats) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_Y16}) {
    depth_->formats = {{fourcc, {kRigSize}, 4}};
    std::vector<std::uint8_t> raw;
    std::uint32_t stride = 0;
    depth_->paint = [&](std::uint64_t sequence, const v4l2_pix_format& format, std::vector<std::uint8_t>& image) {
      for (std::size_t i = 0; i < image.size(); ++i) {
        image[i] = i < 2 ? std::uint8_t{0} : noise(sequence, i);
      }
      raw = image;
      stride = format.bytesperline;
    };
    writer_.reset();
    read();
    for (int y = 0; y < kRigHeight; ++y) {
      for (int x = 0; x < kRigWidth; ++x) {
        const std::size_t pixel = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(2 * x);
        const int units = raw[pixel] + 256 * raw[pixel + 1];
        ASSERT_FLOAT_EQ((*writer_)->depth_m.at(x, y), static_cast<float>(units) / 1000.0F) << x << ", " << y;
      }
    }
    EXPECT_EQ((*writer_)->depth_m.at(0, 0), 0.0F);
  }
}

TEST_F(V4l2Formats, AutoTakesTheFirstOfOursThatTheCameraHas) {
  color_->formats = {{V4L2_PIX_FMT_GREY, {kRigSize}}, {V4L2_PIX_FMT_RGB24, {kRigSize}}, {V4L2_PIX_FMT_NV12, {{640, 480}}}};
  read();
  EXPECT_EQ(format_.pixelformat, V4L2_PIX_FMT_RGB24) << "NV12 comes before it, but not in this size";
}

TEST_F(V4l2Formats, TheFormatAskedForIsTaken) {
  color_->formats = {{V4L2_PIX_FMT_YUYV, {kRigSize}}, {V4L2_PIX_FMT_GREY, {kRigSize}}};
  config_.v4l2.format = "grey";
  read();
  EXPECT_EQ(format_.pixelformat, V4L2_PIX_FMT_GREY);
}

TEST_F(V4l2Formats, AFormatThatTheDriverChangesSilentlyIsRefusedByName) {
  depth_->twist_format = [](v4l2_pix_format& pix) { pix.pixelformat = V4L2_PIX_FMT_BGR32; };
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr(kDepthPath), HasSubstr("z16"), HasSubstr("BGR4")));
}

TEST_F(V4l2Formats, AFormatThatThereIsNotIsRefusedByName) {
  config_.v4l2.format = "mjpeg";
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr(kColorPath), HasSubstr("mjpeg"), HasSubstr("YUYV")));
}

TEST_F(V4l2Formats, AnotherSizeIsRefusedByName) {
  color_->formats = {{V4L2_PIX_FMT_YUYV, {{636, 480}, {320, 240}}}};
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("16x8"), HasSubstr("636x480"), HasSubstr("320x240")));
}

TEST_F(V4l2Formats, WhatCannotBeTrueIsRefused) {
  const std::vector<std::pair<std::function<void(v4l2_pix_format&)>, const char*>> lies{
      {[](v4l2_pix_format& pix) { pix.bytesperline = 31; }, "rows of 31 bytes"},
      {[](v4l2_pix_format& pix) { pix.bytesperline = 1'000'000; }, "rows of 1000000 bytes"},
      {[](v4l2_pix_format& pix) { pix.sizeimage = 255; }, "255 bytes where 16x8 of yuyv takes 256"},
      {[](v4l2_pix_format& pix) { pix.field = V4L2_FIELD_INTERLACED; }, "interlaced"}};
  for (const auto& [lie, words] : lies) {
    color_->twist_format = lie;
    EXPECT_THAT(refusal(), HasSubstr(words));
  }
  color_->twist_format = nullptr;
  depth_->twist_format = [](v4l2_pix_format& pix) { pix.bytesperline = 35, pix.sizeimage = 35 * 8; };
  EXPECT_THAT(refusal(), HasSubstr("split a pixel"));
}

TEST_F(V4l2Formats, RowsWithoutALengthArePacked) {
  offer(V4L2_PIX_FMT_GREY, 0);
  color_->twist_format = [](v4l2_pix_format& pix) { pix.bytesperline = 0; };
  read();
  EXPECT_EQ((*writer_)->gray.at(3, 2), at(2 * kRigWidth + 3));
}

TEST_F(V4l2Formats, NodesThatDeliverNoImagesAreRefused) {
  color_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), HasSubstr("no images"));
  color_->capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), HasSubstr("several planes"));
  color_->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  EXPECT_THAT(refusal(), HasSubstr("cannot stream"));
}

class V4l2Mjpeg : public V4l2Formats {
 protected:
  V4l2Mjpeg() {
    offer(V4L2_PIX_FMT_MJPEG, 0);
    color_->paint = [this](std::uint64_t sequence, const v4l2_pix_format&, std::vector<std::uint8_t>& image) {
      image = sequence == 0 ? first_ : whole_;
    };
    std::vector<std::uint8_t> bgr(kRigWidth * kRigHeight * 3);
    for (std::size_t i = 0; i < bgr.size(); ++i) {
      bgr[i] = static_cast<std::uint8_t>(i % 3 == 0 ? 40 + i / 4 : 90);
    }
    unsigned char* jpeg = nullptr;
    unsigned long size = 0;
    tjhandle compressor = tjInitCompress();
    EXPECT_EQ(tjCompress2(compressor, bgr.data(), kRigWidth, 0, kRigHeight, TJPF_BGR, &jpeg, &size, TJSAMP_422, 95, 0), 0);
    whole_.assign(jpeg, jpeg + size);
    tjFree(jpeg);
    tjDestroy(compressor);
    first_ = whole_;
    reference_.resize(bgr.size());
    tjhandle decompressor = tjInitDecompress();
    EXPECT_EQ(tjDecompress2(decompressor, whole_.data(), whole_.size(), reference_.data(), kRigWidth, 0, kRigHeight, TJPF_BGR, 0),
              0);
    tjDestroy(decompressor);
  }

  /// Without the tables that the standard names: as most cameras send them.
  static std::vector<std::uint8_t> without_tables(const std::vector<std::uint8_t>& jpeg) {
    std::vector<std::uint8_t> out(jpeg.begin(), jpeg.begin() + 2);
    std::size_t at = 2;
    while (jpeg[at + 1] != 0xda) {
      const std::size_t length = 2 + std::size_t{256} * jpeg[at + 2] + jpeg[at + 3];
      if (jpeg[at + 1] != 0xc4) {
        out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at),
                   jpeg.begin() + static_cast<std::ptrdiff_t>(at + length));
      }
      at += length;
    }
    out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
    return out;
  }

  void expect_reference() const {
    const RgbdFrame& frame = *const_cast<FrameWriter&>(*writer_);
    for (int y = 0; y < kRigHeight; ++y) {
      for (int x = 0; x < kRigWidth; ++x) {
        const std::uint8_t* pixel = &reference_[static_cast<std::size_t>(3 * (y * kRigWidth + x))];
        ASSERT_EQ(std::memcmp(frame.bgr.row(y) + 3 * x, pixel, 3), 0) << x << ", " << y;
        ASSERT_NEAR(frame.gray.at(x, y), 0.114 * pixel[0] + 0.587 * pixel[1] + 0.299 * pixel[2], 0.51);
      }
    }
  }

  /// The first image is bad, and the next one is whole.
  std::string bad_then_good() {
    camera_ = camera();
    EXPECT_TRUE(camera_->open());
    writer_.emplace(pool_.acquire().value());
    const CameraRead bad = camera_->read(&**writer_, kNsPerSecond);
    EXPECT_EQ(bad.kind, CameraReadKind::BadFrame);
    const CameraRead good = camera_->read(&**writer_, kNsPerSecond);
    EXPECT_EQ(good.kind, CameraReadKind::Frame) << good.error.message;
    expect_reference();
    EXPECT_THAT(kernel_.violations(), IsEmpty());
    writer_.reset();
    return bad.error.message;
  }

  std::vector<std::uint8_t> whole_;
  std::vector<std::uint8_t> first_;
  std::vector<std::uint8_t> reference_;
};

TEST_F(V4l2Mjpeg, IsDecoded) {
  read();
  expect_reference();
}

TEST_F(V4l2Mjpeg, NeedsNoTables) {
  first_ = without_tables(whole_);
  ASSERT_LT(first_.size(), whole_.size() - 300);
  read();
  expect_reference();
}

TEST_F(V4l2Mjpeg, PaddingIsNoDamage) {
  first_.insert(first_.end() - 2, {0x12, 0x34});  // before the end marker
  first_.insert(first_.end(), 100, 0);            // and behind it
  read();
  expect_reference();
}

TEST_F(V4l2Mjpeg, DamageIsABadFrameAndTheNextIsWhole) {
  first_.resize(first_.size() / 2 + 200);
  EXPECT_THAT(bad_then_good(), testing::AllOf(HasSubstr(kColorPath), HasSubstr("damaged JPEG")));
  first_.assign(3, 0xff);
  EXPECT_THAT(bad_then_good(), HasSubstr("damaged JPEG"));
  first_.assign(500, 0);
  EXPECT_THAT(bad_then_good(), HasSubstr("damaged JPEG"));
  first_ = whole_;
  first_.insert(first_.end() - 2, 400, 0x55);  // more than padding
  EXPECT_THAT(bad_then_good(), HasSubstr("damaged JPEG"));
}

TEST_F(V4l2Mjpeg, AnEmptyImageIsABadFrame) {
  color_->fate = [](std::uint64_t sequence) { return FakeImage{.filled = sequence == 0 ? 0.0 : 1.0}; };
  EXPECT_THAT(bad_then_good(), HasSubstr("0 bytes"));
}

TEST_F(V4l2Mjpeg, AnImageOfAnotherSizeIsABadFrame) {
  for (std::size_t i = 0; i + 8 < first_.size(); ++i) {
    if (first_[i] == 0xff && first_[i + 1] == 0xc0) {
      first_[i + 6] = 4;  // rows
    }
  }
  EXPECT_THAT(bad_then_good(), testing::AllOf(HasSubstr("16x4"), HasSubstr("16x8")));
}

}  // namespace
}  // namespace posed::test
