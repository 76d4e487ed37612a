#pragma once

#include "config/config.h"
#include "config/schema_builder.h"

namespace posed {

/// The sections of where frames come from, and of the lines beside a camera. Reentrant.
void add_source(SchemaBuilder& schema, SourceConfig& config);
void add_gpio(SchemaBuilder& schema, GpioConfig& config);

}  // namespace posed
