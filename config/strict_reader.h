#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/config_schema.h"
#include "config/toml_document.h"
#include "core/result.h"

namespace posed {

/// Fills the variables of a schema from TOML text and collects every mistake, so that all of them can be mended in one go.
/// Reentrant.
class StrictReader {
 public:
  /// `file` names the text in messages.
  StrictReader(std::filesystem::path file, Schema schema);

  /// Assigns what is right in `text` and notes what is not: syntax, unknown or missing keys, types, ranges.
  void read(std::string_view text);

  /// Notes a mistake unless `holds`. `keys` are those that the rule ties together: the first of them that the text has is blamed. A
  /// rule over a key that was refused already says nothing.
  void require(bool holds, std::initializer_list<std::string_view> keys, std::string_view problem);

  /// Notes the mistakes of another file that this one names, already worded.
  void add_foreign(const Error& error) { foreign_.push_back(error.message); }

  /// All mistakes, one a line, in the order of the text.
  Status status() const;

 private:
  struct Mistake {
    TextPosition position;
    std::string text;
  };

  void read_entry(const TomlEntry& entry);
  void note_unknown(const TomlEntry& entry);
  void note(TextPosition position, std::string text) { mistakes_.push_back({position, std::move(text)}); }
  bool is_section_or_above(std::string_view name) const;
  bool is_below_skipped(std::string_view name) const;

  std::filesystem::path file_;
  Schema schema_;
  std::map<std::string, TextPosition, std::less<>> positions_;  ///< of the values of known keys
  std::set<std::string, std::less<>> refused_;                  ///< keys whose value was wrong
  std::vector<std::string> skipped_;                            ///< tables whose contents are not looked at
  std::vector<Mistake> mistakes_;
  std::vector<std::string> foreign_;
};

}  // namespace posed
