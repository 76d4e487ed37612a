#include "drivers/gpio/held_line.h"

#include <utility>

namespace posed {

GpioLine* HeldLine::get(TimeNs now_ns) {
  if (line_ || now_ns < retry_ns_) {
    return line_.get();
  }
  Result<std::unique_ptr<GpioLine>> line = access_.request(request_);
  if (!line) {
    retry_ns_ = now_ns + kRetry_ns;
    tell(line.error());
    return nullptr;
  }
  line_ = std::move(*line);
  held_.store(true, std::memory_order_relaxed);
  told_.clear();
  return line_.get();
}

void HeldLine::lose(const Error& error, TimeNs now_ns) {
  line_.reset();
  held_.store(false, std::memory_order_relaxed);
  retry_ns_ = now_ns + kRetry_ns;
  tell(error);
}

void HeldLine::tell(const Error& error) {
  if (error.message != told_) {
    told_ = error.message;
    on_error_(error);
  }
}

}  // namespace posed
