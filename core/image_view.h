#pragma once

#include <cstddef>
#include <type_traits>

namespace posed {

/// A window on pixels that somebody else owns. Rows are `stride` elements apart; rows of a `FramePool` frame start on
/// 64-byte boundaries and may be read up to their stride. Copying a view copies no pixel. Reentrant.
template <typename T>
struct ImageView {
  T* data = nullptr;
  int width = 0;              ///< pixels a row
  int height = 0;             ///< rows
  std::ptrdiff_t stride = 0;  ///< elements (not bytes) from one row to the next
  int channels = 1;           ///< interleaved elements a pixel

  T* row(int y) const noexcept { return data + y * stride; }
  T& at(int x, int y) const noexcept { return data[y * stride + static_cast<std::ptrdiff_t>(x) * channels]; }
  bool empty() const noexcept { return data == nullptr; }
  bool contains(int x, int y) const noexcept { return x >= 0 && y >= 0 && x < width && y < height; }

  // NOLINTNEXTLINE(google-explicit-constructor): reading asks for less than writing, as with a pointer to const
  operator ImageView<const T>() const noexcept requires(!std::is_const_v<T>) { return {data, width, height, stride, channels}; }
};

}  // namespace posed
