#include "tools/posectl/trajectory_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>

namespace posed {
namespace {

constexpr double kPlotSize = 640;  // pixels, the longer side of the drawing area
constexpr double kMargin = 60;
constexpr double kMinExtent_m = 1e-3;
constexpr std::string_view kAxisNames = "xyz";

/// The plane of the drawing: two world axes and the transform from metres to pixels (y up).
class Canvas {
 public:
  explicit Canvas(const Eigen::AlignedBox3d& box) {
    const Eigen::Vector3d extent = box.sizes();
    const Eigen::Index flattest = std::distance(extent.data(), std::min_element(extent.data(), extent.data() + 3));
    horizontal_ = flattest == 0 ? 1 : 0;
    vertical_ = flattest == 2 ? 1 : 2;
    const double longest_m = std::max({extent[horizontal_], extent[vertical_], kMinExtent_m});
    pixels_per_metre_ = kPlotSize / longest_m;
    left_m_ = box.min()[horizontal_];
    top_m_ = box.max()[vertical_];
    width_ = 2 * kMargin + pixels_per_metre_ * std::max(extent[horizontal_], 0.25 * longest_m);
    height_ = 2 * kMargin + pixels_per_metre_ * std::max(extent[vertical_], 0.25 * longest_m);
  }

  double x(const Eigen::Vector3d& p) const { return kMargin + (p[horizontal_] - left_m_) * pixels_per_metre_; }
  double y(const Eigen::Vector3d& p) const { return kMargin + (top_m_ - p[vertical_]) * pixels_per_metre_; }
  double width() const { return width_; }
  double height() const { return height_; }
  double pixels_per_metre() const { return pixels_per_metre_; }
  char horizontal_name() const { return kAxisNames[static_cast<std::size_t>(horizontal_)]; }
  char vertical_name() const { return kAxisNames[static_cast<std::size_t>(vertical_)]; }

 private:
  Eigen::Index horizontal_ = 0;
  Eigen::Index vertical_ = 1;
  double pixels_per_metre_ = 1;
  double left_m_ = 0;
  double top_m_ = 0;
  double width_ = 0;
  double height_ = 0;
};

std::string polyline(const Canvas& canvas, const std::vector<Eigen::Vector3d>& points, std::string_view style) {
  std::string path = fmt::format("<polyline fill=\"none\" {} points=\"", style);
  for (const Eigen::Vector3d& p : points) {
    fmt::format_to(std::back_inserter(path), "{:.1f},{:.1f} ", canvas.x(p), canvas.y(p));
  }
  return path + "\"/>\n";
}

/// 1, 2 or 5 times a power of ten, about a quarter of the drawing's width.
double scale_bar_length_m(const Canvas& canvas) {
  const double wanted_m = kPlotSize / 4 / canvas.pixels_per_metre();
  const double decade = std::pow(10.0, std::floor(std::log10(wanted_m)));
  const double ratio = wanted_m / decade;
  return decade * (ratio >= 5 ? 5 : ratio >= 2 ? 2 : 1);
}

std::string legend(const Canvas& canvas, const TrajectoryError& error) {
  const double bar_m = scale_bar_length_m(canvas);
  const double bar_y = canvas.height() - kMargin / 3;
  std::string svg;
  fmt::format_to(std::back_inserter(svg),
                 "<text x=\"{0}\" y=\"22\">axes {1} (right) and {2} (up), ATE RMSE {3:.4f} m, max {4:.4f} m</text>\n", kMargin,
                 canvas.horizontal_name(), canvas.vertical_name(), error.ate_m.rmse, error.ate_m.max);
  fmt::format_to(std::back_inserter(svg),
                 "<text x=\"{0}\" y=\"42\"><tspan fill=\"#555\">truth</tspan> <tspan fill=\"#0a58ca\">estimate</tspan> "
                 "<tspan fill=\"#d33\">error</tspan></text>\n",
                 kMargin);
  fmt::format_to(std::back_inserter(svg), "<path d=\"M{0:.1f} {1:.1f}h{2:.1f}\" stroke=\"#000\" stroke-width=\"2\"/>\n", kMargin,
                 bar_y, bar_m * canvas.pixels_per_metre());
  fmt::format_to(std::back_inserter(svg), "<text x=\"{0:.1f}\" y=\"{1:.1f}\">{2:g} m</text>\n",
                 kMargin + bar_m * canvas.pixels_per_metre() + 6, bar_y + 4, bar_m);
  return svg;
}

}  // namespace

std::string plot_trajectories(const Trajectory& truth, const TrajectoryError& error) {
  Eigen::AlignedBox3d box;
  std::vector<Eigen::Vector3d> true_positions;
  std::vector<Eigen::Vector3d> estimated_positions;
  // A recording's ground truth often begins long before its images.
  const std::int64_t first_ns = error.pairs.front().truth.stamp_ns;
  const std::int64_t last_ns = error.pairs.back().truth.stamp_ns;
  for (const StampedPose& pose : truth) {
    if (pose.stamp_ns >= first_ns && pose.stamp_ns <= last_ns) {
      true_positions.push_back(pose.T_world_camera.translation());
      box.extend(true_positions.back());
    }
  }
  for (const PosePair& pair : error.pairs) {
    estimated_positions.push_back(error.T_truth_estimate * pair.estimate.T_world_camera.translation());
    box.extend(estimated_positions.back());
  }
  const Canvas canvas(box);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      canvas.width(), canvas.height());
  for (std::size_t i = 0; i < error.pairs.size(); ++i) {
    svg += polyline(canvas, {estimated_positions[i], error.pairs[i].truth.T_world_camera.translation()},
                    "stroke=\"#d33\" stroke-width=\"0.7\"");
  }
  svg += polyline(canvas, true_positions, "stroke=\"#555\" stroke-width=\"1.5\"");
  svg += polyline(canvas, estimated_positions, "stroke=\"#0a58ca\" stroke-width=\"1.5\"");
  return svg + legend(canvas, error) + "</svg>\n";
}

}  // namespace posed
