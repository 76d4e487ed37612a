#include "detect/network_loader.h"

#include <cstdint>
#include <vector>

#include "core/file_io.h"
#include "detect/network_file.h"
#include "detect/onnx_reader.h"

namespace posed {

Result<Network> load_network(const ModelName& name) {
  std::vector<std::uint8_t> bytes;
  if (const Status read = read_file(name.file, bytes); !read) {
    return tl::unexpected<Error>(read.error());
  }
  Result<Network> network = is_network_file(bytes) ? parse_network(bytes, name.file) : parse_onnx(bytes, name.file);
  return network && name.has_size() ? network->with_input(name.width, name.height) : network;
}

}  // namespace posed
