#include "config/strict_reader.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "config/edit_distance.h"

namespace posed {

namespace {

std::string_view leaf_of(std::string_view name) {
  return name.substr(name.rfind('.') + 1);
}

/// The candidate that `name` was most likely meant to be; empty where none is close. The right name in a wrong table counts as
/// close.
std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 80;
  if (name.size() > kLongest) {
    return "";
  }
  const std::string_view leaf = leaf_of(name);
  std::size_t best_distance = (leaf.size() + 2) / 3 + 1;  // a third of the characters may be wrong
  std::string best;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = leaf == leaf_of(candidate) ? 1 : edit_distance(name, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace

StrictReader::StrictReader(std::filesystem::path file, Schema schema) : file_(std::move(file)), schema_(std::move(schema)) {}

void StrictReader::read(std::string_view text) {
  const tl::expected<std::vector<TomlEntry>, TomlSyntaxError> entries = read_toml(text);
  if (!entries) {
    note(entries.error().position, fmt::format("not valid TOML: {}", entries.error().message));
    return;
  }
  for (const TomlEntry& entry : *entries) {
    read_entry(entry);
  }
  for (const SchemaSection& section : schema_) {
    for (const SchemaKey& key : section.keys) {
      if (key.required && !positions_.contains(key.name)) {
        note({}, fmt::format("{}: missing, expected {}, allowed {}", key.name, type_text(key.field), allowed_text(key.field)));
        refused_.insert(key.name);
      }
    }
  }
}

void StrictReader::read_entry(const TomlEntry& entry) {
  if (is_below_skipped(entry.key)) {
    return;
  }
  const bool is_table = std::holds_alternative<TomlTable>(entry.value.data);
  if (const SchemaKey* key = find_key(schema_, entry.key); key != nullptr) {
    positions_[key->name] = entry.value.position;
    if (const auto problem = assign(key->field, entry.value)) {
      note(problem->position, fmt::format("{}: {}: {}", key->name, problem->value, problem->reason));
      refused_.insert(key->name);
    }
    if (is_table) {
      skipped_.push_back(entry.key);
    }
  } else if (!is_section_or_above(entry.key)) {
    note_unknown(entry);
    skipped_.push_back(entry.key);
  } else if (!is_table) {
    note(entry.value.position,
         fmt::format("{}: {}: wrong type ({}), expected table", entry.key, brief_text(entry.value), type_name(entry.value)));
  }
}

void StrictReader::note_unknown(const TomlEntry& entry) {
  const bool is_table = std::holds_alternative<TomlTable>(entry.value.data);
  std::vector<std::string> candidates;
  std::vector<std::string> neighbours;  // what the same table may hold
  for (const SchemaSection& section : schema_) {
    if (is_table) {
      candidates.push_back(section.name);
      neighbours.push_back(section.name);
      continue;
    }
    for (const SchemaKey& key : section.keys) {
      candidates.push_back(key.name);
      if (entry.key.size() > section.name.size() && entry.key.starts_with(section.name) && entry.key[section.name.size()] == '.' &&
          entry.key.find('.', section.name.size()) == entry.key.rfind('.')) {
        neighbours.emplace_back(leaf_of(key.name));
      }
    }
  }
  const std::string suggestion = nearest(entry.key, candidates);
  std::string hint;
  if (!suggestion.empty()) {
    hint = fmt::format("did you mean {}?", suggestion);
  } else if (!neighbours.empty()) {
    hint = fmt::format("allowed here: {}", fmt::join(neighbours, ", "));
  } else {
    hint = "allowed are only keys in tables, such as [tracker]";
  }
  note(entry.position, is_table ? fmt::format("{}: unknown table; {}", entry.key, hint)
                                : fmt::format("{}: {}: unknown key; {}", entry.key, brief_text(entry.value), hint));
}

void StrictReader::require(bool holds, std::initializer_list<std::string_view> keys, std::string_view problem) {
  if (holds || std::any_of(keys.begin(), keys.end(), [this](std::string_view key) { return refused_.contains(key); })) {
    return;
  }
  const auto in_text = std::find_if(keys.begin(), keys.end(), [this](std::string_view key) { return positions_.contains(key); });
  const std::string_view blamed = in_text != keys.end() ? *in_text : *keys.begin();
  const auto position = positions_.find(blamed);
  note(position != positions_.end() ? position->second : TextPosition{},
       fmt::format("{}: {}: {}", blamed, value_text(find_key(schema_, blamed)->field), problem));
}

Status StrictReader::status() const {
  if (mistakes_.empty() && foreign_.empty()) {
    return {};
  }
  std::vector<Mistake> sorted = mistakes_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Mistake& a, const Mistake& b) {
    const auto rank = [](TextPosition p) { return p.line == 0 ? TextPosition{std::numeric_limits<int>::max(), 0} : p; };
    return rank(a.position) < rank(b.position);  // what is nowhere in the text comes last
  });
  std::vector<std::string> lines;
  for (const Mistake& mistake : sorted) {
    const std::string place = mistake.position.line > 0
                                  ? fmt::format("{}:{}:{}", file_.string(), mistake.position.line, mistake.position.column)
                                  : file_.string();
    lines.push_back(fmt::format("{}: {}", place, mistake.text));
  }
  lines.insert(lines.end(), foreign_.begin(), foreign_.end());
  return make_error(ErrorCode::InvalidConfig, fmt::format("{}", fmt::join(lines, "\n")));
}

bool StrictReader::is_section_or_above(std::string_view name) const {
  return std::any_of(schema_.begin(), schema_.end(), [&](const SchemaSection& section) {
    return section.name == name || (section.name.starts_with(name) && section.name[name.size()] == '.');
  });
}

bool StrictReader::is_below_skipped(std::string_view name) const {
  return std::any_of(skipped_.begin(), skipped_.end(), [&](const std::string& table) {
    return name.size() > table.size() && name.starts_with(table) && name[table.size()] == '.';
  });
}

}  // namespace posed
