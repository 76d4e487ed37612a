#include "tools/posectl/trajectory.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

constexpr std::string_view kBlanks = " \t\r,";
constexpr int kStampDecimals = 9;
/// How far from 1 a quaternion's length may be; four decimals, as in the recordings' ground truth, give 1e-4.
constexpr double kQuaternionTolerance = 0.01;

std::vector<std::string_view> split_fields(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return fields;
}

template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Calls `take(fields)` for every line that is neither empty nor a comment; an error it returns gets file and line put before it.
Status for_each_line(std::string_view text, std::string_view name,
                     const std::function<Status(const std::vector<std::string_view>&)>& take) {
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> fields = split_fields(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (fields.empty() || fields.front().front() == '#') {
      continue;
    }
    if (const Status status = take(fields); !status) {
      return make_error(ErrorCode::BadData, fmt::format("{}:{}: {}", name, line_number, status.error().message));
    }
  }
  return {};
}

/// The stamp of a line, which must be later than the one before.
Result<std::int64_t> next_stamp(std::string_view text, std::optional<std::int64_t> previous) {
  Result<std::int64_t> stamp = parse_trajectory_stamp(text);
  if (stamp && previous && *stamp == *previous) {
    return make_error(ErrorCode::BadData, fmt::format("stamp {} stands here for the second time", text));
  }
  if (stamp && previous && *stamp < *previous) {
    return make_error(ErrorCode::BadData, fmt::format("stamp {} is earlier than {} before it; sort the file by stamps", text,
                                                      format_trajectory_stamp(*previous)));
  }
  return stamp;
}

Result<Se3> parse_pose(const std::vector<std::string_view>& fields) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> value = parse_number<double>(fields[i + 1]);
    if (!value || !std::isfinite(*value)) {
      return make_error(ErrorCode::BadData, fmt::format("field {}, \"{}\", is not a finite number", i + 2, fields[i + 1]));
    }
    v[i] = *value;
  }
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (std::abs(rotation.norm() - 1.0) > kQuaternionTolerance) {
    return make_error(
        ErrorCode::BadData,
        fmt::format("the quaternion's length is {:.4g}, not 1 (the columns are: stamp tx ty tz qx qy qz qw)", rotation.norm()));
  }
  return Se3(rotation, {v[0], v[1], v[2]});
}

}  // namespace

Result<std::int64_t> parse_trajectory_stamp(std::string_view text) {
  const auto fail = [&] {
    return make_error(ErrorCode::InvalidArgument, fmt::format("stamp \"{}\" is not a number of seconds from 0 to 9e9", text));
  };
  const std::size_t exponent_at = std::min(text.find_first_of("eE"), text.size());
  int exponent = 0;
  if (exponent_at < text.size()) {
    std::string_view digits = text.substr(exponent_at + 1);
    digits.remove_prefix(digits.starts_with('+') ? 1 : 0);
    const std::optional<int> parsed = parse_number<int>(digits);
    if (!parsed || std::abs(*parsed) > 100) {
      return fail();
    }
    exponent = *parsed;
  }
  const std::string_view mantissa = text.substr(0, exponent_at);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  std::string digits(mantissa.substr(0, point));
  if (point < mantissa.size()) {
    digits += mantissa.substr(point + 1);
  }
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos) {
    return fail();
  }
  // The nanoseconds are the digits up to nine places behind the decimal point; the next digit rounds.
  const std::ptrdiff_t kept = static_cast<std::ptrdiff_t>(point) + exponent + kStampDecimals;
  if (kept < 0) {
    return 0;
  }
  const auto whole = static_cast<std::size_t>(kept);
  const bool round_up = whole < digits.size() && digits[whole] >= '5';
  digits.resize(whole, '0');
  const std::optional<std::int64_t> value = digits.empty() ? 0 : parse_number<std::int64_t>(digits);
  if (!value || *value > 9'000'000'000'000'000'000) {
    return fail();
  }
  return *value + (round_up ? 1 : 0);
}

std::string format_trajectory_stamp(std::int64_t stamp_ns) {
  const std::int64_t seconds = stamp_ns / 1'000'000'000;
  const std::int64_t fraction_ns = stamp_ns % 1'000'000'000;
  return fraction_ns % 1'000 == 0 ? fmt::format("{}.{:06}", seconds, fraction_ns / 1'000)
                                  : fmt::format("{}.{:09}", seconds, fraction_ns);
}

Result<Trajectory> parse_trajectory(std::string_view text, std::string_view name) {
  Trajectory trajectory;
  const Status status = for_each_line(text, name, [&](const std::vector<std::string_view>& fields) -> Status {
    if (fields.size() != 8) {
      return make_error(ErrorCode::BadData, fmt::format("{} fields where a pose has 8: stamp tx ty tz qx qy qz qw", fields.size()));
    }
    const Result<std::int64_t> stamp =
        next_stamp(fields[0], trajectory.empty() ? std::nullopt : std::optional(trajectory.back().stamp_ns));
    if (!stamp) {
      return tl::unexpected(stamp.error());
    }
    const Result<Se3> pose = parse_pose(fields);
    if (!pose) {
      return tl::unexpected(pose.error());
    }
    trajectory.push_back({*stamp, *pose});
    return {};
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  return trajectory;
}

Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  const Result<std::string> text = read_whole_file(path);
  if (!text) {
    return tl::unexpected(text.error());
  }
  return parse_trajectory(*text, path.string());
}

std::string format_trajectory(const Trajectory& trajectory) {
  std::string text = "# timestamp [s] tx ty tz [m] qx qy qz qw\n";
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d& t = pose.T_world_camera.translation();
    const Eigen::Quaterniond& q = pose.T_world_camera.rotation();
    fmt::format_to(std::back_inserter(text), "{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                   format_trajectory_stamp(pose.stamp_ns), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

Result<std::vector<std::int64_t>> read_frame_stamps(const std::filesystem::path& path) {
  const Result<std::string> text = read_whole_file(path);
  if (!text) {
    return tl::unexpected(text.error());
  }
  std::vector<std::int64_t> stamps;
  const Status status = for_each_line(*text, path.string(), [&](const std::vector<std::string_view>& fields) -> Status {
    if (fields.size() < 2) {
      return make_error(ErrorCode::BadData, "a frame needs a stamp and a path");
    }
    const Result<std::int64_t> stamp = next_stamp(fields[0], stamps.empty() ? std::nullopt : std::optional(stamps.back()));
    if (!stamp) {
      return tl::unexpected(stamp.error());
    }
    stamps.push_back(*stamp);
    return {};
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  return stamps;
}

}  // namespace posed
