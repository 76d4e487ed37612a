#pragma once

#include <memory>
#include <string>

#include "core/result.h"

/// The few things that posed asks of a GPIO chip, so that tests can stand in for one. Levels are logical throughout: a line that is
/// active low is active while it is low.
namespace posed {

enum class LineDirection { Input, Output };

struct LineRequest {
  std::string chip;  ///< name, label, path or number
  int offset = 0;
  bool active_low = false;
  LineDirection direction = LineDirection::Output;  ///< an output begins inactive
};

/// A line of a chip, held until it is destroyed. Thread-bound. After an error it is of no more use. Does not block.
class GpioLine {
 public:
  virtual ~GpioLine() = default;

  virtual Result<bool> is_active() = 0;
  virtual Status set_active(bool active) = 0;  ///< outputs alone

  /// Becomes readable when an input has changed; -1 where the chip cannot tell, and of outputs.
  virtual int event_fd() const = 0;

  /// Forgets the changes so far; true where there were some.
  virtual Result<bool> take_events() = 0;
};

/// Thread-bound. No exception leaves it.
class LineAccess {
 public:
  virtual ~LineAccess() = default;

  /// Errors: NotFound (no such chip or line), Unavailable (somebody else has it), Io.
  virtual Result<std::unique_ptr<GpioLine>> request(const LineRequest& request) = 0;
};

}  // namespace posed
