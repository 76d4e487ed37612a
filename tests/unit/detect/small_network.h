#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "detect/calibration.h"
#include "detect/network.h"
#include "detect/onnx_reader.h"

/// The network that data/make_small_network.py made, and what PyTorch makes of `fill_test_input`.
namespace posed::test {

inline std::string small_onnx_path() {
  return POSED_SOURCE_DIR "/tests/unit/detect/data/small.onnx";
}

inline std::vector<std::uint8_t> file_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline Network small_network() {
  return read_onnx(small_onnx_path()).value();
}

/// The same numbers as the script's `test_input`; `first` other than 0 gives other images.
inline void fill_test_input(std::span<float> input, std::uint32_t first = 0) {
  for (std::size_t i = 0; i < input.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i) + first;
    input[i] = static_cast<float>((index * 2654435761U >> 16) % 256) / 255.0F;
  }
}

/// Of both outputs, one after the other.
inline std::vector<float> expected_outputs() {
  const std::vector<std::uint8_t> bytes = file_bytes(POSED_SOURCE_DIR "/tests/unit/detect/data/small_outputs.bin");
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

inline Network calibrated_small_network(CalibrationMethod method = CalibrationMethod::MeanSquaredError) {
  const auto image = [](std::size_t index, std::span<float> input) {
    fill_test_input(input, 1000 * static_cast<std::uint32_t>(index));
    return Status{};
  };
  return calibrate(small_network(), 4, image, method).value();
}

struct Difference {
  double largest = 0;
  double relative = 0;  ///< root of the mean square over that of the reference
};

inline Difference difference(std::span<const float> values, std::span<const float> reference) {
  Difference result;
  double squares = 0;
  double reference_squares = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double error = std::abs(static_cast<double>(values[i]) - static_cast<double>(reference[i]));
    result.largest = std::max(result.largest, error);
    squares += error * error;
    reference_squares += static_cast<double>(reference[i]) * static_cast<double>(reference[i]);
  }
  result.relative = std::sqrt(squares / reference_squares);
  return result;
}

}  // namespace posed::test
