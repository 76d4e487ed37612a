#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/mutex.h"
#include "core/result.h"

namespace posed {

/// What a source complains of while it runs: the first few messages, and the last error, which tells why it failed. Thread-safe.
class SourceErrors {
 public:
  void add(const Error& error);

  /// Prints the messages that were not printed yet; true where there were any.
  bool print_new(std::ostream& err);

  /// As `print_new`, and how many more messages there were.
  void print_rest(std::ostream& err);

  Error last() const;

 private:
  mutable Mutex mutex_;
  std::size_t count_ POSED_GUARDED_BY(mutex_) = 0;
  std::size_t printed_ POSED_GUARDED_BY(mutex_) = 0;
  std::vector<std::string> first_ POSED_GUARDED_BY(mutex_);
  Error last_ POSED_GUARDED_BY(mutex_){ErrorCode::Io, "the source has failed"};
};

}  // namespace posed
