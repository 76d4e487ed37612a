#pragma once

#include <filesystem>

#include "config/model_name.h"
#include "core/result.h"
#include "detect/network.h"

namespace posed {

/// Reads a network file of either kind, by what it begins with, for images of the size that the name asks for. Errors as in
/// `read_network` (detect/network_file.h), `read_onnx` (detect/onnx_reader.h) and `Network::with_input`. Reentrant.
Result<Network> load_network(const ModelName& name);

}  // namespace posed
