#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

/// TOML text as plain values with positions. The one place that knows the parser library.
namespace posed {

/// Where something stands in a text; both count from 1 (columns in code points), 0 is unknown.
struct TextPosition {
  int line = 0;
  int column = 0;
  friend auto operator<=>(const TextPosition&, const TextPosition&) = default;
};

/// A table's contents are entries of their own; this marks that there is a table.
struct TomlTable {};
/// Dates and times: no key takes one, so only that it was one is kept.
struct TomlDateTime {};

struct TomlValue {
  std::variant<bool, std::int64_t, double, std::string, std::vector<TomlValue>, TomlTable, TomlDateTime> data;
  TextPosition position;
};

/// One key of a table. `key` is dotted from the root; a part that is no bare key is quoted in it: `a."b c"`.
struct TomlEntry {
  std::string key;
  TextPosition position;  ///< of the key; that of the value is in the value
  TomlValue value;
};

struct TomlSyntaxError {
  TextPosition position;
  std::string message;
};

/// Tables nested deeper than this are not listed; no key of ours has as many parts.
inline constexpr int kMaxTableDepth = 8;

/// The entries of a TOML 1.0 document, tables before what they hold. Stops at the first syntax error, of which a key given twice is
/// one. Reentrant.
tl::expected<std::vector<TomlEntry>, TomlSyntaxError> read_toml(std::string_view text);

/// "integer", "float", "string", "boolean", "array", "table" or "date-time".
std::string_view type_name(const TomlValue& value);

/// The value as TOML on one line of at most about 60 characters, for messages.
std::string brief_text(const TomlValue& value);

/// How TOML writes a basic string or a float: `quoted` escapes what must be, `real_text` gives the shortest text that reads back
/// the same.
std::string quoted(std::string_view text);
std::string real_text(double value);

}  // namespace posed
