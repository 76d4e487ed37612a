#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "config/config_field.h"

/// The one description of every key: what the loader accepts, and what docs/configuration.md and config/posed.toml say. Defaults
/// are not repeated: they are what a default-constructed struct holds.
namespace posed {

struct SchemaKey {
  std::string name;  ///< dotted from the root, as in "tracker.features"
  Field field;
  std::string_view unit;  ///< empty where there is none
  std::string_view description;
  bool required = false;  ///< the file must have it
  bool live = false;      ///< a running daemon takes a new value; the others need a restart
};

struct SchemaSection {
  std::string name;  ///< of the TOML table
  std::string_view description;
  std::vector<SchemaKey> keys;
};

using Schema = std::vector<SchemaSection>;

/// The keys of the daemon's configuration, bound to the variables of `config`, which must outlive the schema and stay where it is.
Schema config_schema(Config& config);

/// The keys of a camera calibration file, bound to the variables of `intrinsics`.
Schema camera_schema(CameraIntrinsics& intrinsics);

/// The key called `name`, or nullptr.
const SchemaKey* find_key(const Schema& schema, std::string_view name);

}  // namespace posed
