#include "drivers/libcamera/libcamera_controls.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <libcamera/control_ids.h>

namespace posed {

namespace {

template <typename T>
std::optional<T> number_in(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Whether the camera takes the value; one that tells no limits takes all.
template <typename T>
bool is_within(const libcamera::ControlInfo& info, T value) {
  const auto is_limit = [&](const libcamera::ControlValue& limit) {
    return limit.type() == libcamera::ControlValue(value).type() && !limit.isArray();
  };
  return (!is_limit(info.min()) || value >= info.min().get<T>()) && (!is_limit(info.max()) || value <= info.max().get<T>());
}

template <typename T>
std::optional<libcamera::ControlValue> number_value(const libcamera::ControlInfo& info, std::string_view text) {
  const std::optional<T> value = number_in<T>(text);
  return value && is_within(info, *value) ? std::optional(libcamera::ControlValue(*value)) : std::nullopt;
}

std::optional<libcamera::ControlValue> value_of(const libcamera::ControlId& id, const libcamera::ControlInfo& info,
                                                std::string_view text) {
  switch (id.type()) {
    case libcamera::ControlTypeBool:
      return text == "true"    ? std::optional(libcamera::ControlValue(true))
             : text == "false" ? std::optional(libcamera::ControlValue(false))
                               : std::nullopt;
    case libcamera::ControlTypeByte: return number_value<std::uint8_t>(info, text);
    case libcamera::ControlTypeInteger32: return number_value<std::int32_t>(info, text);
    case libcamera::ControlTypeInteger64: return number_value<std::int64_t>(info, text);
    case libcamera::ControlTypeFloat: return number_value<float>(info, text);
    default: return std::nullopt;
  }
}

std::string allowed_values(const libcamera::ControlId& id, const libcamera::ControlInfo& info) {
  switch (id.type()) {
    case libcamera::ControlTypeBool: return "allowed true or false";
    case libcamera::ControlTypeByte:
    case libcamera::ControlTypeInteger32:
    case libcamera::ControlTypeInteger64:
      return fmt::format("allowed whole numbers from {} to {}", info.min().toString(), info.max().toString());
    case libcamera::ControlTypeFloat:
      return fmt::format("allowed numbers from {} to {}", info.min().toString(), info.max().toString());
    default: return "a control of lists or areas cannot be set";
  }
}

std::string names_of(const libcamera::ControlInfoMap& known) {
  std::vector<std::string> names;
  for (const auto& [id, info] : known) {
    names.push_back(id->name());
  }
  std::sort(names.begin(), names.end());
  return names.empty() ? "it has none" : fmt::format("it has {}", fmt::join(names, ", "));
}

}  // namespace

Result<libcamera::ControlList> parse_controls(const libcamera::ControlInfoMap& known, const std::vector<std::string>& settings) {
  libcamera::ControlList controls(libcamera::controls::controls);
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    const std::string_view name = std::string_view(setting).substr(0, equals);
    const std::string_view text = equals == std::string::npos ? "" : std::string_view(setting).substr(equals + 1);
    const auto control =
        std::find_if(known.begin(), known.end(), [&](const auto& candidate) { return candidate.first->name() == name; });
    if (control == known.end()) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("source.libcamera.controls: the camera has no control \"{}\"; {}", name, names_of(known)));
    }
    const auto& [id, info] = *control;
    const std::optional<libcamera::ControlValue> value = value_of(*id, info, text);
    if (!value) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("source.libcamera.controls: {} = \"{}\": {}", name, text, allowed_values(*id, info)));
    }
    controls.set(id->id(), *value);
  }
  return controls;
}

TimeNs set_frame_period(const libcamera::ControlInfoMap& known, TimeNs period_ns, libcamera::ControlList& controls) {
  const auto limits = known.find(libcamera::controls::FrameDurationLimits.id());
  if (limits == known.end() || controls.contains(libcamera::controls::FrameDurationLimits.id())) {
    return period_ns;
  }
  std::int64_t period_us = period_ns / kNsPerUs;
  const auto limit = [](const libcamera::ControlValue& value, std::int64_t otherwise) {
    return value.type() == libcamera::ControlTypeInteger64 && !value.isArray() ? value.get<std::int64_t>() : otherwise;
  };
  period_us = std::min(period_us, limit(limits->second.max(), period_us));
  period_us = std::max(period_us, limit(limits->second.min(), period_us));
  const std::array<std::int64_t, 2> both{period_us, period_us};
  controls.set(libcamera::controls::FrameDurationLimits, libcamera::Span<const std::int64_t, 2>(both));
  return period_us * kNsPerUs;
}

}  // namespace posed
