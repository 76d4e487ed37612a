// What an image of a camera costs on the capture thread: depth registered to colour, with SIMD and without, and the conversions.

#include <cmath>
#include <cstdlib>
#include <turbojpeg.h>
#include <vector>

#include <benchmark/benchmark.h>

#include "core/frame_pool.h"
#include "drivers/depth_registration.h"
#include "drivers/mjpeg_decoder.h"
#include "drivers/pixel_conversion.h"
#include "drivers/yuv_conversion.h"
#include "tests/support/scalar_registration.h"

namespace posed {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

enum Lenses : std::int64_t { Ideal, Distorted };

CameraIntrinsics camera(double scale, std::int64_t lenses) {
  CameraIntrinsics k;
  k.width = static_cast<int>(scale * kWidth);
  k.height = static_cast<int>(scale * kHeight);
  k.fx = k.fy = scale * 525.0;
  k.cx = scale * 319.5;
  k.cy = scale * 239.5;
  k.depth_units_per_metre = 1000.0;
  if (lenses == Distorted) {
    k.k1 = 0.12;
    k.k2 = -0.21;
    k.p1 = 0.0011;
    k.k3 = 0.05;
  }
  return k;
}

/// A wall with a step in it, a tenth of it unseen.
std::vector<std::uint16_t> scene() {
  std::vector<std::uint16_t> raw;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool unseen = (x / 8 + y / 8) % 10 == 0;
      raw.push_back(static_cast<std::uint16_t>(unseen ? 0 : x > 200 && x < 350 ? 900 + y / 4 : 2000 + x));
    }
  }
  return raw;
}

/// Arguments: the colour image's size in tenths of 640x480; Lenses.
template <bool kSimd>
void register_depth(benchmark::State& state) {
  const double scale = static_cast<double>(state.range(0)) / 10.0;
  const CameraIntrinsics depth = camera(1.0, state.range(1));
  const CameraIntrinsics color = camera(scale, state.range(1));
  const Se3 T_camera_depth(exp_so3({0.004, -0.002, 0.003}), {0.025, 0.001, 0.002});
  const DepthRegistration registration(depth, color, T_camera_depth);
  const test::ScalarRegistration scalar(depth, color, T_camera_depth, registration.half_patch());
  const std::vector<std::uint16_t> raw = scene();
  FramePool pool(color.width, color.height, 1);
  FrameWriter frame = pool.acquire().value();
  const ImageView<const std::uint16_t> view{raw.data(), kWidth, kHeight, kWidth, 1};
  for (auto _ : state) {
    if constexpr (kSimd) {
      registration.apply(view, frame->depth_m);
    } else {
      scalar.apply(view, frame->depth_m);
    }
    benchmark::ClobberMemory();
  }
}
BENCHMARK(register_depth<true>)
    ->Name("registration/simd")
    ->ArgsProduct({{10, 15, 20}, {Ideal, Distorted}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(register_depth<false>)
    ->Name("registration/scalar")
    ->ArgsProduct({{10, 15, 20}, {Ideal, Distorted}})
    ->Unit(benchmark::kMillisecond);

std::vector<std::uint8_t> noise(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = static_cast<std::uint8_t>((i * 2654435761U) >> 9);
  }
  return bytes;
}

void yuyv(benchmark::State& state) {
  const std::vector<std::uint8_t> image = noise(std::size_t{2} * kWidth * kHeight);
  FramePool pool(kWidth, kHeight, 1);
  FrameWriter frame = pool.acquire().value();
  for (auto _ : state) {
    bgr_and_gray_from_yuyv({image.data(), kWidth, kHeight, 2 * kWidth, 2}, {}, frame->bgr, frame->gray);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(yuyv)->Unit(benchmark::kMillisecond);

void nv12(benchmark::State& state) {
  const std::vector<std::uint8_t> image = noise(std::size_t{2} * kWidth * kHeight);
  FramePool pool(kWidth, kHeight, 1);
  FrameWriter frame = pool.acquire().value();
  const std::uint8_t* chroma = image.data() + kWidth * kHeight;
  for (auto _ : state) {
    bgr_and_gray_from_nv12({image.data(), kWidth, kHeight, kWidth, 1}, {chroma, kWidth, kHeight / 2, kWidth, 1}, {}, frame->bgr,
                           frame->gray);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(nv12)->Unit(benchmark::kMillisecond);

void rgb24(benchmark::State& state) {
  const std::vector<std::uint8_t> image = noise(std::size_t{3} * kWidth * kHeight);
  FramePool pool(kWidth, kHeight, 1);
  FrameWriter frame = pool.acquire().value();
  for (auto _ : state) {
    swap_red_blue({image.data(), kWidth, kHeight, 3 * kWidth, 3}, frame->bgr);
    gray_from_bgr(frame->bgr, frame->gray);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(rgb24)->Unit(benchmark::kMillisecond);

void z16(benchmark::State& state) {
  const std::vector<std::uint16_t> raw = scene();
  FramePool pool(kWidth, kHeight, 1);
  FrameWriter frame = pool.acquire().value();
  for (auto _ : state) {
    depth_from_raw({raw.data(), kWidth, kHeight, kWidth, 1}, 1000.0, frame->depth_m);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(z16)->Unit(benchmark::kMillisecond);

/// Waves with a little noise: 4:2:2, quality 85, as a webcam sends.
void mjpeg(benchmark::State& state) {
  std::vector<std::uint8_t> bgr = noise(std::size_t{3} * kWidth * kHeight);
  for (std::size_t i = 0; i < bgr.size(); ++i) {
    const double wave = std::sin(static_cast<double>(i / 3 % kWidth) / 9.0) * std::cos(static_cast<double>(i / 3 / kWidth) / 7.0);
    bgr[i] = static_cast<std::uint8_t>(120.0 + 90.0 * wave + bgr[i] / 16.0);
  }
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  tjhandle compressor = tjInitCompress();
  if (tjCompress2(compressor, bgr.data(), kWidth, 0, kHeight, TJPF_BGR, &jpeg, &size, TJSAMP_422, 85, 0) != 0) {
    state.SkipWithError("no JPEG to decode");
  }
  FramePool pool(kWidth, kHeight, 1);
  FrameWriter frame = pool.acquire().value();
  MjpegDecoder decoder;
  for (auto _ : state) {
    if (!decoder.decode({jpeg, size}, frame->bgr, frame->gray)) {
      state.SkipWithError("the JPEG is damaged");
      break;
    }
    benchmark::ClobberMemory();
  }
  tjFree(jpeg);
  tjDestroy(compressor);
  state.counters["KiB"] = static_cast<double>(size) / 1024.0;
}
BENCHMARK(mjpeg)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace posed
