#include "detect/network_loader.h"

#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/file_io.h"
#include "detect/network_file.h"
#include "detect/onnx_reader.h"

namespace posed {

Result<Network> NetworkLoader::load(const ModelName& name) {
  if (name.sizes.size() > 1) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: one size is wanted, not {}", to_string(name), name.sizes.size()));
  }
  if (!network_ || file_ != name.file) {
    std::vector<std::uint8_t> bytes;
    if (const Status read = read_file(name.file, bytes); !read) {
      return tl::unexpected<Error>(read.error());
    }
    Result<Network> network = is_network_file(bytes) ? parse_network(bytes, name.file) : parse_onnx(bytes, name.file);
    if (!network) {
      return network;
    }
    network_ = std::move(*network);
    file_ = name.file;
  }
  return name.sizes.empty() ? *network_ : network_->with_input(name.sizes[0].width, name.sizes[0].height);
}

Result<Network> load_network(const ModelName& name) {
  return NetworkLoader().load(name);
}

}  // namespace posed
