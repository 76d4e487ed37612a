#include "tools/posectl/camera_text.h"

#include <algorithm>

#include <fmt/format.h>

namespace posed {

std::string format_camera(const CameraIntrinsics& camera, std::string_view comment) {
  std::string text;
  while (!comment.empty()) {
    const std::size_t end = std::min(comment.find('\n'), comment.size());
    text += fmt::format("# {}\n", comment.substr(0, end));
    comment.remove_prefix(std::min(end + 1, comment.size()));
  }
  text += fmt::format(
      "[camera]\nwidth = {}\nheight = {}\nfx = {:#}\nfy = {:#}\ncx = {:#}\ncy = {:#}\n"
      "distortion = [{:#}, {:#}, {:#}, {:#}, {:#}]  # k1, k2, p1, p2, k3\ndepth_units_per_metre = {:#}\nbaseline_fx = {:#}\n",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.k1, camera.k2, camera.p1, camera.p2,
      camera.k3, camera.depth_units_per_metre, camera.baseline_fx);
  if (camera.depth_delay_s != 0) {
    text += fmt::format("depth_delay_s = {:#}\n", camera.depth_delay_s);
  }
  return text;
}

}  // namespace posed
