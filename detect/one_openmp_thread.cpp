#include "detect/one_openmp_thread.h"

// Two routines of the OpenMP API, declared here because <omp.h> belongs to the compiler: clang's comes with another run-time than
// the one that Debian's oneDNN is linked with (libgomp).
extern "C" void omp_set_num_threads(int threads);
extern "C" int omp_get_max_threads();

namespace posed {

OneOpenMpThread::OneOpenMpThread() : before_(omp_get_max_threads()) {
  omp_set_num_threads(1);
}

OneOpenMpThread::~OneOpenMpThread() {
  omp_set_num_threads(before_);
}

}  // namespace posed
