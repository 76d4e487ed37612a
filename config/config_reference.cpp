#include "config/config_reference.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "config/config_schema.h"

namespace posed {

namespace {

constexpr std::string_view kPageStart = R"(# Configuration

posed reads one [TOML](https://toml.io/en/v1.0.0) file. Every key can be left out and then has the default below; an empty file is a
valid configuration. [config/posed.toml](../config/posed.toml) has every key at its default.

The file is read strictly. An unknown key, a wrong type, a value out of range, a key given twice: each is a mistake that is reported with
file, line, column, key, the value read and what is allowed, all mistakes of a file at once, and the program exits with 78 (EX_CONFIG)
before it touches a device. `posed --check-config FILE` only checks.

- A *number* may be written without a point, an *integer* may not be written with one. `nan` and `inf` are refused.
- Limits are inclusive.
- A *pose* `T_a_b` is the array `[x, y, z, qx, qy, qz, qw]`: metres, then a quaternion whose norm is 1 within 0.001. It maps coordinates
  in b to coordinates in a.
- *Live*: whether a running daemon takes a new value; otherwise it needs a restart.
)";

constexpr std::string_view kCameraStart = R"(
## Camera calibration files

The file that `camera.calibration` names, read as strictly. A relative name is looked for beside the configuration file, then in the
folders of the environment variable `POSED_CAMERA_PATH` (separated by colons), then among the shipped ones in `config/cameras/`.
)";

constexpr std::string_view kPageEnd = R"(
---

This page and `config/posed.toml` are generated from `config/config_schema.cpp`; after a change there:

```
cmake --build build/dev --target posed_config_reference && build/dev/config/posed_config_reference .
```
)";

/// A "|" would end the cell.
std::string cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '|' ? std::string("\\|") : std::string(1, c);
  }
  return out;
}

std::string_view leaf_of(const SchemaKey& key) {
  return std::string_view(key.name).substr(key.name.rfind('.') + 1);
}

std::string table_row(const SchemaKey& key) {
  const std::string default_text = key.required ? "required" : fmt::format("`{}`", value_text(key.field));
  return fmt::format("| `{}` | {} | {} | {} | {} | {} | {} |\n", leaf_of(key), type_text(key.field), cell(default_text),
                     cell(allowed_text(key.field)), key.unit, key.live ? "yes" : "no", cell(key.description));
}

std::string section_text(const SchemaSection& section, std::string_view heading) {
  std::string page = fmt::format("\n{} `[{}]`\n\n{}\n\n", heading, section.name, section.description);
  page += "| key | type | default | allowed | unit | live | description |\n| --- | --- | --- | --- | --- | --- | --- |\n";
  for (const SchemaKey& key : section.keys) {
    page += table_row(key);
  }
  return page;
}

/// `text` as comment lines of at most 100 characters.
std::string comment(std::string_view text) {
  constexpr std::size_t kWidth = 100;
  std::string out;
  std::string line = "#";
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    if (line.size() + 1 + word.size() > kWidth) {
      out += line + "\n";
      line = "#";
    }
    line += fmt::format(" {}", word);
  }
  return out + line + "\n";
}

std::string values_text(const Schema& schema, bool with_comments) {
  std::string text;
  for (const SchemaSection& section : schema) {
    text += (text.empty() ? "" : "\n") + (with_comments ? comment(section.description) : "") + fmt::format("[{}]\n", section.name);
    for (const SchemaKey& key : section.keys) {
      if (with_comments) {
        const std::string unit = key.unit.empty() ? "" : fmt::format(" [{}]", key.unit);
        text += "\n" + comment(fmt::format("{} Allowed: {}{}.", key.description, allowed_text(key.field), unit));
      }
      text += fmt::format("{} = {}\n", leaf_of(key), value_text(key.field));
    }
  }
  return text;
}

}  // namespace

std::string configuration_reference() {
  Config config;
  CameraIntrinsics intrinsics;
  std::string page(kPageStart);
  for (const SchemaSection& section : config_schema(config)) {
    page += section_text(section, "##");
  }
  page += kCameraStart;
  for (const SchemaSection& section : camera_schema(intrinsics)) {
    page += section_text(section, "###");
  }
  return page.append(kPageEnd);
}

std::string example_configuration() {
  Config config;
  return comment(
             "posed's configuration: every key at its default. Generated from config/config_schema.cpp; docs/configuration.md "
             "explains how the file is read.") +
         "\n" + values_text(config_schema(config), true);
}

std::string to_toml(const Config& config) {
  Config copy = config;  // the schema binds to variables that could be written
  return values_text(config_schema(copy), false);
}

std::string to_toml(const CameraIntrinsics& intrinsics) {
  CameraIntrinsics copy = intrinsics;
  return values_text(camera_schema(copy), false);
}

}  // namespace posed
