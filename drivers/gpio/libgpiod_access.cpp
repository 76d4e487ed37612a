#include "drivers/gpio/libgpiod_access.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <gpiod.h>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "drivers/gpio_listing.h"

namespace posed {

namespace {

constexpr const char* kConsumer = "posed";

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }  // gives its lines back, too
};
using Chip = std::unique_ptr<gpiod_chip, ChipCloser>;

std::string text_of(const char* text) {
  return text == nullptr ? "" : text;
}

/// "gpio: ACTION: REASON", for the error number `error`.
tl::unexpected<Error> failure(std::string_view action, int error) {
  const bool is_away = error == ENOENT || error == ENODEV || error == ENXIO;
  const ErrorCode code = error == EBUSY ? ErrorCode::Unavailable : is_away ? ErrorCode::NotFound : ErrorCode::Io;
  return make_error(code, fmt::format("gpio: {}: {}", action, std::generic_category().message(error)));
}

class LibgpiodLine final : public GpioLine {
 public:
  LibgpiodLine(Chip chip, gpiod_line* line, std::string name, bool tells_events)
      : chip_(std::move(chip)), line_(line), name_(std::move(name)), tells_events_(tells_events) {}

  Result<bool> is_active() override {
    const int value = gpiod_line_get_value(line_);
    if (value < 0) {
      return failure(name_ + " cannot be read", errno);
    }
    return value != 0;
  }

  Status set_active(bool active) override {
    if (gpiod_line_set_value(line_, active ? 1 : 0) != 0) {
      return failure(name_ + " cannot be set", errno);
    }
    return {};
  }

  int event_fd() const override { return tells_events_ ? gpiod_line_event_get_fd(line_) : -1; }

  Result<bool> take_events() override {
    bool taken = false;
    // A line that changes faster than this loop runs must not keep it: what is left is taken the next time.
    for (int reads = 0; tells_events_ && reads < kMostReads; ++reads) {
      const timespec at_once{0, 0};
      const int waiting = gpiod_line_event_wait(line_, &at_once);
      if (waiting == 0) {
        break;
      }
      std::array<gpiod_line_event, 16> events;  // the kernel keeps so many
      if (waiting < 0 || gpiod_line_event_read_multiple(line_, events.data(), events.size()) < 0) {
        return failure(name_ + " cannot be read", errno);
      }
      taken = true;
    }
    return taken;
  }

 private:
  static constexpr int kMostReads = 4;

  Chip chip_;
  gpiod_line* line_;  // the chip's
  std::string name_;  // for messages: "line 17 of gpiochip0"
  bool tells_events_;
};

class LibgpiodAccess final : public LineAccess {
 public:
  Result<std::unique_ptr<GpioLine>> request(const LineRequest& request) override {
    Chip chip(gpiod_chip_open_lookup(request.chip.c_str()));
    if (!chip) {
      return failure("chip \"" + request.chip + "\" cannot be opened", errno);
    }
    std::string name = fmt::format("line {} of {}", request.offset, text_of(gpiod_chip_name(chip.get())));
    if (static_cast<unsigned>(request.offset) >= gpiod_chip_num_lines(chip.get())) {
      return make_error(ErrorCode::NotFound,
                        fmt::format("gpio: {}: the chip has {} lines", name, gpiod_chip_num_lines(chip.get())));
    }
    gpiod_line* const line = gpiod_chip_get_line(chip.get(), static_cast<unsigned>(request.offset));
    if (line == nullptr) {
      return failure(name + " cannot be opened", errno);
    }
    const int flags = request.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    bool tells_events = false;
    int status = -1;
    if (request.direction == LineDirection::Output) {
      status = gpiod_line_request_output_flags(line, kConsumer, flags, 0);
    } else {
      status = gpiod_line_request_both_edges_events_flags(line, kConsumer, flags);
      tells_events = status == 0;
      if (status != 0 && errno != EBUSY) {  // a chip without interrupts can be read all the same
        status = gpiod_line_request_input_flags(line, kConsumer, flags);
      }
    }
    if (status != 0) {
      const int error = errno;
      const std::string owner = text_of(gpiod_line_consumer(line));
      return failure(name + (owner.empty() ? " cannot be had" : " cannot be had, \"" + owner + "\" has it"), error);
    }
    return std::make_unique<LibgpiodLine>(std::move(chip), line, std::move(name), tells_events);
  }
};

Result<ListedGpioChip> list_chip(const std::string& path) {
  const Chip chip(gpiod_chip_open(path.c_str()));
  if (!chip) {
    return failure(path + " cannot be opened", errno);
  }
  ListedGpioChip listed{text_of(gpiod_chip_name(chip.get())), text_of(gpiod_chip_label(chip.get())), {}};
  const unsigned count = gpiod_chip_num_lines(chip.get());
  for (unsigned offset = 0; offset < count; ++offset) {
    gpiod_line* const line = gpiod_chip_get_line(chip.get(), offset);
    if (line == nullptr) {
      return failure(fmt::format("line {} of {} cannot be looked at", offset, listed.name), errno);
    }
    listed.lines.push_back({text_of(gpiod_line_name(line)), text_of(gpiod_line_consumer(line)), gpiod_line_is_used(line)});
  }
  return listed;
}

}  // namespace

std::unique_ptr<LineAccess> make_libgpiod_access() {
  return std::make_unique<LibgpiodAccess>();
}

Result<std::vector<ListedGpioChip>> list_gpio_chips() {
  std::vector<std::string> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator entry("/dev", error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().filename().string().starts_with("gpiochip")) {
      paths.push_back(entry->path());
    }
  }
  if (error) {
    return failure("/dev cannot be read", error.value());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<ListedGpioChip> chips;
  for (const std::string& path : paths) {
    Result<ListedGpioChip> chip = list_chip(path);
    if (!chip) {
      return tl::unexpected<Error>(chip.error());
    }
    chips.push_back(std::move(*chip));
  }
  return chips;
}

}  // namespace posed
