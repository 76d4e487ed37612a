#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <ostream>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>
#include <lcm/lcm-cpp.hpp>

#include "config/config.h"
#include "core/clock.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/watch_messages.h"
#include "tools/posectl/watch_statistics.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

constexpr int kWaitPeriod_ms = 100;
constexpr TimeNs kTablePeriod_ns = 100 * kNsPerMs;
constexpr TimeNs kLinePeriod_ns = kNsPerSecond;
constexpr int kQueueCapacity = 10'000;  // messages; LCM's own is 30, a second of poses
constexpr int kReceiveBufferBytes = 2 << 20;

struct WatchOptions {
  std::string url = PublisherConfig{}.url;
  std::string prefix = PublisherConfig{}.channel_prefix;
  std::uint64_t count = 0;  // 0: no end
  double timeout_s = 0;     // 0: none
  std::filesystem::path csv;
  std::optional<std::int64_t> first_sequence;
};

/// A larger socket buffer than the system's default, so that a busy machine loses no message; where the URL asks for one, that
/// counts.
std::string receiving_url(const std::string& url) {
  if (!url.starts_with("udpm://") || url.find("recv_buf_size") != std::string::npos) {
    return url;
  }
  return fmt::format("{}{}recv_buf_size={}", url, url.find('?') == std::string::npos ? '?' : '&', kReceiveBufferBytes);
}

/// Receives, counts and shows. Thread-bound.
class Watcher {
 public:
  Watcher(const WatchOptions& options, const Console& console)
      : options_(options), console_(console), lcm_(receiving_url(options.url)), statistics_(options.first_sequence) {}

  /// Returns the exit code.
  int run();

 private:
  Status open();

  /// A function with a context, not a member: through LCM's pointer to a member, gcc 12's null check sees a null that is not there.
  template <typename Message>
  void subscribe(const char* channel) {
    void (*handler)(const lcm::ReceiveBuffer*, const std::string&, const Message*, Watcher*) =
        [](const lcm::ReceiveBuffer*, const std::string&, const Message* message, Watcher* self) { self->take(*message); };
    lcm_.subscribeFunction(options_.prefix + channel, handler, this)->setQueueCapacity(kQueueCapacity);
  }

  void take(const pose_t& message);
  void take(const status_t& message);
  Status receive();
  void show(TimeNs now_ns);
  void draw_table();
  int conclude();

  bool complete() const { return options_.count > 0 && statistics_.received >= options_.count; }

  const WatchOptions& options_;
  const Console& console_;
  lcm::LCM lcm_;
  WatchStatistics statistics_;
  std::optional<HealthReport> health_;
  std::ofstream csv_;
  TimeNs last_message_ns_ = 0;
  TimeNs next_show_ns_ = 0;
  std::int64_t lines_on_screen_ = 0;
};

Status Watcher::open() {
  if (!lcm_.good()) {
    return make_error(
        ErrorCode::Unavailable,
        fmt::format("LCM cannot start on '{}'; where the machine has no multicast route, give it one: 'ip link set lo multicast "
                    "on' and 'ip route add 224.0.0.0/4 dev lo' (as root)",
                    options_.url));
  }
  // Waits up to 10 s for a message from itself to come back; without one, liblcm aborts at the first subscription.
  if (lcm_.getFileno() < 0) {
    return make_error(
        ErrorCode::Unavailable,
        fmt::format("LCM receives nothing on '{}', not even what this program sends itself: see the routing tables and "
                    "the firewall",
                    options_.url));
  }
  if (!options_.csv.empty()) {
    if (const Status status = check_writable(options_.csv); !status) {
      return status;
    }
    csv_.open(options_.csv);
    csv_ << watch_csv_header();
  }
  subscribe<pose_t>("POSE");
  subscribe<status_t>("STATUS");
  return {};
}

void Watcher::take(const pose_t& message) {
  if (complete()) {
    return;  // what LCM had in its queue beyond the count
  }
  last_message_ns_ = SystemClock::instance().now_ns();
  statistics_.observe(from_pose_message(message, last_message_ns_));
  if (csv_.is_open()) {
    csv_ << watch_csv_row(statistics_.last);
  }
}

void Watcher::take(const status_t& message) {
  last_message_ns_ = SystemClock::instance().now_ns();
  health_ = from_status_message(message);
}

Status Watcher::receive() {
  const InterruptGuard interrupt;
  const TimeNs timeout_ns = from_seconds(options_.timeout_s);
  last_message_ns_ = SystemClock::instance().now_ns();
  while (!complete() && !interrupt.requested()) {
    const int handled = lcm_.handleTimeout(kWaitPeriod_ms);
    if (interrupt.requested()) {
      break;
    }
    if (handled < 0 && options_.url.starts_with("file://")) {
      break;  // the log has ended
    }
    if (handled < 0) {
      return make_error(ErrorCode::Io, fmt::format("LCM cannot receive on '{}'", options_.url));
    }
    const TimeNs now_ns = SystemClock::instance().now_ns();
    if (timeout_ns > 0 && now_ns - last_message_ns_ > timeout_ns) {
      break;
    }
    show(now_ns);
  }
  return {};
}

void Watcher::show(TimeNs now_ns) {
  if (statistics_.received == 0 || now_ns < next_show_ns_) {
    return;
  }
  next_show_ns_ = now_ns + (console_.out_is_terminal ? kTablePeriod_ns : kLinePeriod_ns);
  if (console_.out_is_terminal) {
    draw_table();
  } else {
    fmt::print(console_.out, "{}\n", format_watch_line(statistics_));
  }
  console_.out.flush();
}

void Watcher::draw_table() {
  const std::string table = format_watch_table(statistics_, health_);
  if (lines_on_screen_ > 0) {
    fmt::print(console_.out, "\x1b[{}F\x1b[J", lines_on_screen_);  // up to the table's first line, and erase from there
  }
  // A line that wrapped would be two to the terminal and one to the count: switch wrapping off while the table is drawn.
  fmt::print(console_.out, "\x1b[?7l{}\x1b[?7h", table);
  lines_on_screen_ = std::count(table.begin(), table.end(), '\n');
}

int Watcher::conclude() {
  if (console_.out_is_terminal && statistics_.received > 0) {
    draw_table();
  }
  fmt::print(console_.out, "{}", format_watch_summary(statistics_));
  if (csv_.is_open() && !csv_.flush()) {
    return report_error(console_.err, {ErrorCode::Io, fmt::format("cannot write {}", options_.csv.string())});
  }
  if (statistics_.received == 0) {
    fmt::print(console_.err, "posectl: no pose came on channel {}POSE of '{}'; is posed running, with the same URL and prefix?\n",
               options_.prefix, options_.url);
    return kExitNegative;
  }
  const bool all_came = options_.count == 0 || complete();
  return all_came && statistics_.sequence.gaps() == 0 ? kExitOk : kExitNegative;
}

int Watcher::run() {
  if (const Status status = open(); !status) {
    return report_error(console_.err, status.error());
  }
  fmt::print(console_.out, "watching {}POSE on {}\n", options_.prefix, options_.url);
  console_.out.flush();
  if (const Status status = receive(); !status) {
    return report_error(console_.err, status.error());
  }
  return conclude();
}

}  // namespace

void add_watch_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* command = parent.add_subcommand(
      "watch", "Show the poses and the health that a daemon publishes. Exit code 1 where frames are missing in their sequence");
  command->add_option("--url", options->url, "LCM's URL, as in publisher.url")->capture_default_str();
  command->add_option("--prefix", options->prefix, "Channel prefix, as in publisher.channel_prefix")->capture_default_str();
  command->add_option("--count", options->count, "End after so many poses; fewer (see --timeout) give exit code 1")
      ->check(CLI::PositiveNumber);
  command->add_option("--timeout", options->timeout_s, "End when no message has come for so long [s]")->check(CLI::PositiveNumber);
  command->add_option("--csv", options->csv, "Write every pose to this file, as it comes");
  command->add_option("--expect-from-sequence", options->first_sequence,
                      "The frame that must be the first to come; what is missing before the first that came is then a gap, too");
  command->callback([options, &console, &exit_code] { exit_code = Watcher(*options, console).run(); });
}

}  // namespace posed
