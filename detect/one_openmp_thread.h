#pragma once

namespace posed {

/// While it lives, OpenMP regions that the calling thread enters (oneDNN's) run on that thread alone. OpenMP keeps the number of
/// threads for each thread, so others are not concerned. Thread-bound.
class OneOpenMpThread {
 public:
  OneOpenMpThread();
  ~OneOpenMpThread();
  OneOpenMpThread(const OneOpenMpThread&) = delete;
  OneOpenMpThread& operator=(const OneOpenMpThread&) = delete;

 private:
  int before_;
};

}  // namespace posed
