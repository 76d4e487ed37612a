#pragma once

#include <optional>
#include <string>

#include "config/model_name.h"
#include "core/result.h"
#include "detect/network.h"

namespace posed {

/// Reads network files of either kind, by what they begin with, for images of the sizes that the names ask for. Keeps the file that
/// it read last, since the rungs of a ladder are mostly one network at several sizes. Thread-bound.
class NetworkLoader {
 public:
  /// At most one size. Errors as in `read_network` (detect/network_file.h), `read_onnx` (detect/onnx_reader.h) and
  /// `Network::with_input`; InvalidArgument, too, for several sizes.
  Result<Network> load(const ModelName& name);

 private:
  std::string file_;
  std::optional<Network> network_;  ///< as the file says
};

/// For one network. Errors as in `NetworkLoader`. Reentrant.
Result<Network> load_network(const ModelName& name);

}  // namespace posed
