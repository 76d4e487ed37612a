#include "config/model_name.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

namespace posed {
namespace {

constexpr std::size_t kMostDigits = 4;

std::optional<int> parse_side(std::string_view digits) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (digits.empty() || digits.size() > kMostDigits || !std::all_of(digits.begin(), digits.end(), is_digit)) {
    return std::nullopt;
  }
  int side = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), side);
  return side > 0 ? std::optional(side) : std::nullopt;
}

}  // namespace

ModelName parse_model_name(std::string_view text) {
  const std::size_t at = text.rfind('@');
  const std::size_t times = text.rfind('x');
  if (at == std::string_view::npos || at == 0 || times == std::string_view::npos || times < at) {
    return {std::string(text), 0, 0};
  }
  const std::optional<int> width = parse_side(text.substr(at + 1, times - at - 1));
  const std::optional<int> height = parse_side(text.substr(times + 1));
  if (!width || !height) {
    return {std::string(text), 0, 0};
  }
  return {std::string(text.substr(0, at)), *width, *height};
}

std::string to_string(const ModelName& name) {
  return name.has_size() ? fmt::format("{}@{}x{}", name.file, name.width, name.height) : name.file;
}

}  // namespace posed
