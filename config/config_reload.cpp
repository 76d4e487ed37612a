#include "config/config_reload.h"

#include <variant>

#include "config/config_field.h"
#include "config/config_reference.h"
#include "config/config_schema.h"

namespace posed {

namespace {

/// Copies the variable behind one field to that behind the other; both are of the same key.
void copy_value(const Field& from, const Field& to) {
  std::visit(
      [&](const auto& source) {
        using Kind = std::decay_t<decltype(source)>;
        const Kind& target = std::get<Kind>(to);
        if constexpr (std::is_same_v<Kind, ChoiceField>) {
          target.set(source.get());
        } else if constexpr (std::is_same_v<Kind, IntegerField>) {
          std::visit([&](auto* value) { *std::get<std::decay_t<decltype(value)>>(target.value) = *value; }, source.value);
        } else if constexpr (std::is_same_v<Kind, RealListField>) {
          for (std::size_t i = 0; i < source.values.size(); ++i) {
            *target.values[i] = *source.values[i];
          }
        } else {
          *target.value = *source.value;
        }
      },
      from);
}

}  // namespace

ReloadOutcome take_live_values(const Config& fresh, Config& running) {
  ReloadOutcome outcome;
  Config source = fresh;  // the schema binds to variables that could be written
  const Schema from = config_schema(source);
  const Schema to = config_schema(running);
  for (std::size_t section = 0; section < from.size(); ++section) {
    for (std::size_t i = 0; i < from[section].keys.size(); ++i) {
      const SchemaKey& key = from[section].keys[i];
      const SchemaKey& present = to[section].keys[i];
      if (value_text(key.field) == value_text(present.field)) {
        continue;
      }
      if (key.live) {
        copy_value(key.field, present.field);
        outcome.taken.push_back(key.name);
      } else {
        outcome.refused.push_back(key.name);
      }
    }
  }
  if (fresh.camera.calibration == running.camera.calibration && to_toml(fresh.intrinsics) != to_toml(running.intrinsics)) {
    outcome.refused.emplace_back("camera.calibration");
  }
  return outcome;
}

}  // namespace posed
