// Any bytes, decoded as a PNG or JPEG: as a header, as a colour image and as a depth image of 16 x 12 pixels. Nothing is written beyond
// the images (the address sanitizer looks), and depth is a number that is not negative.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "core/image_view.h"
#include "drivers/image_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace posed;
  constexpr int kWidth = 16;
  constexpr int kHeight = 12;
  static ImageDecoder decoder;  // kept, as a recording's is: what one image leaves behind must not hurt the next
  std::vector<std::uint8_t> bgr(std::size_t{3} * kWidth * kHeight);
  std::vector<std::uint8_t> gray(std::size_t{1} * kWidth * kHeight);
  std::vector<float> depth_m(std::size_t{1} * kWidth * kHeight);
  const ImageView<std::uint8_t> bgr_view{bgr.data(), kWidth, kHeight, std::ptrdiff_t{3} * kWidth, 3};
  const ImageView<std::uint8_t> gray_view{gray.data(), kWidth, kHeight, kWidth, 1};
  const ImageView<float> depth_view{depth_m.data(), kWidth, kHeight, kWidth, 1};
  const std::span<const std::uint8_t> file(data, size);

  (void)decoder.decode_header(file);
  (void)decoder.decode_color(file, bgr_view, gray_view);
  if (decoder.decode_depth(file, 5000.0, depth_view)) {
    for (const float metres : depth_m) {
      if (!(metres >= 0.0F) || !std::isfinite(metres)) {
        std::fprintf(stderr, "a depth of %f m\n", static_cast<double>(metres));
        std::abort();
      }
    }
  }
  return 0;
}
