#include "tools/posectl/model_images.h"

#include <fmt/format.h>

namespace posed {

Status ModelImages::fill(std::size_t index, std::span<float> input) {
  if (input_.channels != 3) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("the network takes {} channels, an image has 3", input_.channels));
  }
  if (const Status read = image_.read(paths_[index]); !read) {
    return read;
  }
  letterbox_.place(image_.bgr(), input);
  return {};
}

}  // namespace posed
