// Not linked into any program: compiled alone with clang's thread-safety analysis, with and without the mistake.
#include "core/mutex.h"

namespace {

class Guarded {
 public:
  void increment() {
#ifndef POSED_UNGUARDED_ACCESS
    const posed::MutexLock lock(mutex_);
#endif
    ++value_;
  }

 private:
  posed::Mutex mutex_;
  int value_ POSED_GUARDED_BY(mutex_) = 0;
};

}  // namespace

int main() {
  Guarded guarded;
  guarded.increment();
}
