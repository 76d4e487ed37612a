#include "drivers/v4l2/v4l2_controls.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace posed {

namespace {

struct Control {
  std::uint32_t id = 0;
  std::uint32_t type = 0;
  std::uint32_t flags = 0;
  std::string word;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::uint64_t step = 1;
};

struct MenuEntry {
  std::int64_t index = 0;
  std::string word;
};

constexpr std::size_t kMostControls = 1024;  // of a driver that never ends its list

/// One after `id`, by the interface of 64 bits or the older one. Nothing at the end.
std::optional<Control> next_control(const V4l2Device& device, std::uint32_t id) {
  v4l2_query_ext_ctrl query{};
  query.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  const int done = device.ioctl(VIDIOC_QUERY_EXT_CTRL, &query);
  if (done >= 0) {
    return Control{query.id, query.type, query.flags, control_word(query.name), query.minimum, query.maximum, query.step};
  }
  if (done != -ENOTTY) {
    return std::nullopt;
  }
  v4l2_queryctrl old{};
  old.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  if (device.ioctl(VIDIOC_QUERYCTRL, &old) < 0) {
    return std::nullopt;
  }
  // The kernel's array of bytes holds a name with its end.
  return Control{old.id,
                 old.type,
                 old.flags,
                 control_word(reinterpret_cast<const char*>(old.name)),
                 old.minimum,
                 old.maximum,
                 static_cast<std::uint64_t>(std::max(old.step, 0))};
}

std::vector<Control> controls_of(const V4l2Device& device) {
  std::vector<Control> controls;
  for (std::optional<Control> next = next_control(device, 0); next && controls.size() < kMostControls;
       next = next_control(device, next->id)) {
    if ((next->flags & V4L2_CTRL_FLAG_DISABLED) == 0 && next->type != V4L2_CTRL_TYPE_CTRL_CLASS) {
      controls.push_back(*next);
    }
  }
  return controls;
}

bool is_menu(const Control& control) {
  return control.type == V4L2_CTRL_TYPE_MENU || control.type == V4L2_CTRL_TYPE_INTEGER_MENU;
}

/// A menu may have gaps.
std::vector<MenuEntry> entries_of(const V4l2Device& device, const Control& control) {
  constexpr std::int64_t kMostEntries = 256;
  std::vector<MenuEntry> entries;
  for (std::int64_t i = control.minimum; i <= std::min(control.maximum, control.minimum + kMostEntries); ++i) {
    v4l2_querymenu menu{};
    menu.id = control.id;
    menu.index = static_cast<std::uint32_t>(i);
    if (device.ioctl(VIDIOC_QUERYMENU, &menu) >= 0) {
      // The kernel's structure is packed: take the value, not a reference to it.
      const auto value = static_cast<std::int64_t>(menu.value);
      entries.push_back({i, control.type == V4L2_CTRL_TYPE_MENU ? control_word(reinterpret_cast<const char*>(menu.name))
                                                                : std::to_string(value)});
    }
  }
  return entries;
}

std::string allowed_values(const Control& control, const std::vector<MenuEntry>& entries) {
  if (is_menu(control)) {
    std::string text;
    for (const MenuEntry& entry : entries) {
      text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", entry.index, entry.word);
    }
    return text;
  }
  switch (control.type) {
    case V4L2_CTRL_TYPE_BOOLEAN: return "0 (false) and 1 (true)";
    case V4L2_CTRL_TYPE_BITMASK: return fmt::format("0 and the bits of {:#x}", control.maximum);
    default:
      return control.step > 1 ? fmt::format("{} to {} in steps of {}", control.minimum, control.maximum, control.step)
                              : fmt::format("{} to {}", control.minimum, control.maximum);
  }
}

std::optional<std::int64_t> whole_number(std::string_view text) {
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  std::int64_t value = 0;
  const char* begin = text.data() + (hexadecimal ? 2 : 0);
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(begin, end, value, hexadecimal ? 16 : 10);
  const bool whole = error == std::errc() && stopped == end && !(hexadecimal && *begin == '-');
  return whole ? std::optional(value) : std::nullopt;
}

bool allows(const Control& control, const std::vector<MenuEntry>& entries, std::int64_t value) {
  if (is_menu(control)) {
    return std::any_of(entries.begin(), entries.end(), [&](const MenuEntry& entry) { return entry.index == value; });
  }
  if (control.type == V4L2_CTRL_TYPE_BUTTON) {
    return true;
  }
  if (control.type == V4L2_CTRL_TYPE_BITMASK) {
    return (static_cast<std::uint64_t>(value) & ~static_cast<std::uint64_t>(control.maximum)) == 0;
  }
  const std::uint64_t above = static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(control.minimum);
  return value >= control.minimum && value <= control.maximum && above % std::max<std::uint64_t>(control.step, 1) == 0;
}

/// What the text means for this control; nothing where it means nothing that is allowed.
std::optional<std::int64_t> value_of(const Control& control, const std::vector<MenuEntry>& entries, std::string_view text) {
  std::optional<std::int64_t> value = whole_number(text);
  if (control.type == V4L2_CTRL_TYPE_BOOLEAN && (text == "true" || text == "false")) {
    value = text == "true" ? 1 : 0;
  }
  if (control.type == V4L2_CTRL_TYPE_MENU && !value) {
    const auto named = std::find_if(entries.begin(), entries.end(), [&](const MenuEntry& entry) { return entry.word == text; });
    if (named != entries.end()) {
      value = named->index;
    }
  }
  return value && allows(control, entries, *value) ? value : std::nullopt;
}

int write_value(const V4l2Device& device, const Control& control, std::int64_t value) {
  if (control.type != V4L2_CTRL_TYPE_INTEGER64) {
    v4l2_control small{control.id, static_cast<std::int32_t>(value)};
    return device.ioctl(VIDIOC_S_CTRL, &small);
  }
  v4l2_ext_control large{};
  large.id = control.id;
  large.value64 = value;
  v4l2_ext_controls one{};
  one.which = V4L2_CTRL_WHICH_CUR_VAL;
  one.count = 1;
  one.controls = &large;
  return device.ioctl(VIDIOC_S_EXT_CTRLS, &one);
}

Status set_control(const V4l2Device& device, const Control& control, std::string_view text) {
  if (control.type > V4L2_CTRL_TYPE_INTEGER_MENU || control.type == V4L2_CTRL_TYPE_STRING) {
    return device.unsupported(fmt::format("control {}: its value is no number, and cannot be set here", control.word));
  }
  if ((control.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) {
    return device.unsupported(fmt::format("control {}: can only be read", control.word));
  }
  const std::vector<MenuEntry> entries = is_menu(control) ? entries_of(device, control) : std::vector<MenuEntry>{};
  const std::optional<std::int64_t> value = value_of(control, entries, text);
  if (!value) {
    return device.unsupported(fmt::format("control {} = {}: allowed is {}", control.word, text, allowed_values(control, entries)));
  }
  if (const int done = write_value(device, control, *value); done < 0) {
    return device.failure(fmt::format("control {} = {}", control.word, text), done);
  }
  return {};
}

std::string words_of(const std::vector<Control>& controls) {
  std::string text;
  for (const Control& control : controls) {
    text += (text.empty() ? "" : ", ") + control.word;
  }
  return text.empty() ? "none" : text;
}

}  // namespace

std::string control_word(const char* name) {
  std::string word;
  bool between = false;
  for (; *name != '\0'; ++name) {
    const auto letter = static_cast<unsigned char>(*name);
    if (std::isalnum(letter) == 0) {
      between = true;
      continue;
    }
    if (between && !word.empty()) {
      word += '_';
    }
    between = false;
    word += static_cast<char>(std::tolower(letter));
  }
  return word;
}

Status set_controls(const V4l2Device& device, const std::vector<std::string>& settings) {
  if (settings.empty()) {
    return {};
  }
  const std::vector<Control> controls = controls_of(device);
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
      return device.unsupported(fmt::format("the setting \"{}\" is not NAME=VALUE", setting));
    }
    const std::string_view name = std::string_view(setting).substr(0, equals);
    const auto control = std::find_if(controls.begin(), controls.end(), [&](const Control& c) { return c.word == name; });
    if (control == controls.end()) {
      return device.unsupported(fmt::format("has no control {}; it has {}", name, words_of(controls)));
    }
    if (Status set = set_control(device, *control, std::string_view(setting).substr(equals + 1)); !set) {
      return set;
    }
  }
  return {};
}

}  // namespace posed
