#include "config/toml_document.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

// The header-only form, so that sanitizers and fuzzers see into the parser; errors come back as values.
#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0

#include <fmt/format.h>
#include <toml++/toml.h>

namespace posed {

namespace {

TextPosition to_position(const toml::source_position& position) {
  return {static_cast<int>(position.line), static_cast<int>(position.column)};
}

bool is_bare_key(std::string_view key) {
  return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

TomlValue to_value(const toml::node& node) {
  TomlValue value;
  value.position = to_position(node.source().begin);
  switch (node.type()) {
    case toml::node_type::boolean: value.data = node.as_boolean()->get(); break;
    case toml::node_type::integer: value.data = node.as_integer()->get(); break;
    case toml::node_type::floating_point: value.data = node.as_floating_point()->get(); break;
    case toml::node_type::string: value.data = node.as_string()->get(); break;
    case toml::node_type::array: {
      std::vector<TomlValue> elements;
      for (const toml::node& element : *node.as_array()) {
        elements.push_back(to_value(element));
      }
      value.data = std::move(elements);
      break;
    }
    case toml::node_type::table: value.data = TomlTable{}; break;
    case toml::node_type::date:
    case toml::node_type::time:
    case toml::node_type::date_time:
    case toml::node_type::none: value.data = TomlDateTime{}; break;
  }
  return value;
}

/// Lists `table` and the tables below it, down to kMaxTableDepth: a hostile text nests as deep as it is long.
void flatten(const toml::table& table, const std::string& prefix, int depth, std::vector<TomlEntry>& entries) {
  for (const auto& [key, node] : table) {
    TomlEntry entry;
    entry.key = prefix + (is_bare_key(key.str()) ? std::string(key.str()) : quoted(key.str()));
    entry.position = to_position(key.source().begin);
    entry.value = to_value(node);
    const std::string inner_prefix = entry.key + ".";
    entries.push_back(std::move(entry));
    if (const toml::table* inner = node.as_table(); inner != nullptr && depth < kMaxTableDepth) {
      flatten(*inner, inner_prefix, depth + 1, entries);
    }
  }
}

/// Bytes of the UTF-8 sequence at the start of `text`, 0 where there is none. Source: the table of well-formed sequences, Unicode
/// 15, section 3.9, table 3-7.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
  };
  const auto in = [](unsigned value, unsigned low, unsigned high) { return value >= low && value <= high; };
  const unsigned lead = byte(0);
  if (lead < 0x80) {
    return 1;
  }
  const std::size_t length = in(lead, 0xC2, 0xDF) ? 2 : in(lead, 0xE0, 0xEF) ? 3 : in(lead, 0xF0, 0xF4) ? 4 : 0;
  const unsigned low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  const unsigned high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (length == 0 || !in(byte(1), low, high)) {
    return 0;
  }
  for (std::size_t i = 2; i < length; ++i) {
    if (!in(byte(i), 0x80, 0xBF)) {
      return 0;
    }
  }
  return length;
}

/// Where `text` stops being UTF-8. The parser notices too, but looks at blocks of bytes and cannot say where.
std::optional<TextPosition> find_invalid_utf8(std::string_view text) {
  TextPosition position{1, 1};
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) {
      return position;
    }
    position = text.front() == '\n' ? TextPosition{position.line + 1, 1} : TextPosition{position.line, position.column + 1};
    text.remove_prefix(length);
  }
  return std::nullopt;
}

/// The parser begins its messages with "Error while parsing <what>: ".
std::string without_preamble(std::string_view description) {
  constexpr std::string_view kPreamble = "Error while parsing ";
  const std::size_t colon = description.find(": ");
  if (description.starts_with(kPreamble) && colon != std::string_view::npos) {
    return fmt::format("{} (in a {})", description.substr(colon + 2),
                       description.substr(kPreamble.size(), colon - kPreamble.size()));
  }
  return std::string(description);
}

std::string array_text(const std::vector<TomlValue>& elements) {
  constexpr std::size_t kMaxElements = 8;
  std::string text = "[";
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (i == kMaxElements) {
      return text + ", ...]";
    }
    const bool nested = std::holds_alternative<std::vector<TomlValue>>(elements[i].data);
    text += (i == 0 ? "" : ", ") + (nested ? std::string("[...]") : brief_text(elements[i]));
  }
  return text + "]";
}

}  // namespace

tl::expected<std::vector<TomlEntry>, TomlSyntaxError> read_toml(std::string_view text) {
  if (const std::optional<TextPosition> position = find_invalid_utf8(text)) {
    return tl::unexpected(TomlSyntaxError{*position, "not UTF-8 text"});
  }
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) {
    const toml::parse_error& error = parsed.error();
    return tl::unexpected(TomlSyntaxError{to_position(error.source().begin), without_preamble(error.description())});
  }
  std::vector<TomlEntry> entries;
  flatten(parsed.table(), "", 1, entries);
  return entries;
}

std::string_view type_name(const TomlValue& value) {
  constexpr std::string_view kNames[] = {"boolean", "integer", "float", "string", "array", "table", "date-time"};
  return kNames[value.data.index()];
}

std::string brief_text(const TomlValue& value) {
  constexpr std::size_t kMaxCharacters = 60;
  if (const auto* flag = std::get_if<bool>(&value.data)) {
    return *flag ? "true" : "false";
  }
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) {
    return fmt::format("{}", *integer);
  }
  if (const auto* real = std::get_if<double>(&value.data)) {
    return real_text(*real);
  }
  if (const auto* text = std::get_if<std::string>(&value.data)) {
    std::size_t length = std::min(text->size(), kMaxCharacters);
    while (length < text->size() && length > 0 && (static_cast<unsigned char>((*text)[length]) & 0xC0U) == 0x80U) {
      --length;  // not in the middle of a UTF-8 sequence
    }
    return quoted(text->substr(0, length)) + (length < text->size() ? "..." : "");
  }
  if (const auto* elements = std::get_if<std::vector<TomlValue>>(&value.data)) {
    return array_text(*elements);
  }
  return std::holds_alternative<TomlTable>(value.data) ? "a table" : "a date or time";
}

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || code == 0x7F) {
      out += fmt::format("\\u{:04X}", code);
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string real_text(double value) {
  if (std::isnan(value)) {
    return "nan";  // TOML has no use for the sign
  }
  std::string text = fmt::format("{}", value);
  if (std::isfinite(value) && text.find_first_of(".e") == std::string::npos) {
    text += ".0";
  }
  return text;
}

}  // namespace posed
