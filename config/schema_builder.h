#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/config_schema.h"

/// What the parts of the schema are written with. Reentrant.
namespace posed {

template <typename Enum>
using Names = std::vector<std::pair<std::string_view, Enum>>;

template <typename Enum>
ChoiceField choice(Enum& value, Names<Enum> names) {
  ChoiceField field;
  for (const auto& [name, unused] : names) {
    field.names.push_back(name);
  }
  field.get = [&value, names] {
    return std::find_if(names.begin(), names.end(), [&](const auto& n) { return n.second == value; })->first;
  };
  field.set = [&value, names](std::string_view text) {
    value = std::find_if(names.begin(), names.end(), [&](const auto& n) { return n.first == text; })->second;
  };
  return field;
}

inline ChoiceField choice(std::string& value, std::vector<std::string_view> names) {
  return {std::move(names), [&value] { return std::string_view(value); }, [&value](std::string_view text) { value = text; }};
}

inline IntegerField integer(int& value, int minimum, int maximum) {
  return {&value, minimum, maximum};
}
inline IntegerField integer(std::int64_t& value, std::int64_t minimum, std::int64_t maximum) {
  return {&value, minimum, maximum};
}
inline RealField real(double& value, double minimum, double maximum) {
  return {&value, minimum, maximum};
}

inline bool is_path(std::string_view text) {
  return text.find('\0') == std::string_view::npos;
}

/// Collects sections; names keys by their section.
class SchemaBuilder {
 public:
  SchemaBuilder& section(std::string name, std::string_view description) {
    schema_.push_back({std::move(name), description, {}});
    return *this;
  }

  SchemaBuilder& key(std::string_view name, Field field, std::string_view unit, std::string_view description) {
    SchemaSection& section = schema_.back();
    section.keys.push_back({section.name + "." + std::string(name), std::move(field), unit, description});
    return *this;
  }

  /// The file must have the key added last.
  SchemaBuilder& required() {
    schema_.back().keys.back().required = true;
    return *this;
  }

  /// A running daemon takes a new value of the key added last.
  SchemaBuilder& live() {
    schema_.back().keys.back().live = true;
    return *this;
  }

  Schema build() && { return std::move(schema_); }

 private:
  Schema schema_;
};

}  // namespace posed
