#include "tools/posectl/source_errors.h"

#include <ostream>

#include <fmt/ostream.h>

namespace posed {
namespace {

constexpr std::size_t kMaxErrorsShown = 10;

}  // namespace

void SourceErrors::add(const Error& error) {
  const MutexLock lock(mutex_);
  ++count_;
  last_ = error;
  if (first_.size() < kMaxErrorsShown) {
    first_.push_back(error.message);
  }
}

bool SourceErrors::print_new(std::ostream& err) {
  const MutexLock lock(mutex_);
  const bool any = printed_ < first_.size();
  while (printed_ < first_.size()) {
    fmt::print(err, "posectl: {}\n", first_[printed_++]);
  }
  return any;
}

void SourceErrors::print_rest(std::ostream& err) {
  print_new(err);
  const MutexLock lock(mutex_);
  if (count_ > first_.size()) {
    fmt::print(err, "posectl: and {} more such messages\n", count_ - first_.size());
  }
}

Error SourceErrors::last() const {
  const MutexLock lock(mutex_);
  return last_;
}

}  // namespace posed
