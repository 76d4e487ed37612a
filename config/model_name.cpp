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

std::optional<InputSize> parse_size(std::string_view text) {
  const std::size_t times = text.find('x');
  if (times == std::string_view::npos) {
    return std::nullopt;
  }
  const std::optional<int> width = parse_side(text.substr(0, times));
  const std::optional<int> height = parse_side(text.substr(times + 1));
  return width && height ? std::optional(InputSize{*width, *height}) : std::nullopt;
}

}  // namespace

ModelName parse_model_name(std::string_view text) {
  const ModelName whole{std::string(text), {}};
  const std::size_t at = text.rfind('@');
  if (at == std::string_view::npos || at == 0) {
    return whole;
  }
  ModelName name{std::string(text.substr(0, at)), {}};
  for (std::size_t begin = at + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    const std::optional<InputSize> size = parse_size(text.substr(begin, end - begin));
    if (!size) {
      return whole;
    }
    name.sizes.push_back(*size);
    begin = end + 1;
  }
  return name;
}

std::string to_string(const ModelName& name) {
  std::string text = name.file;
  for (const InputSize& size : name.sizes) {
    text += fmt::format("{}{}x{}", &size == name.sizes.data() ? '@' : '+', size.width, size.height);
  }
  return text;
}

}  // namespace posed
