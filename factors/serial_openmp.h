#pragma once

#include "core/thread_limit.h"

// Declared here: omp.h comes with the compiler's own OpenMP, and the option -fopenmp would make Eigen use threads.
extern "C" {
int omp_get_max_active_levels(void);
void omp_set_max_active_levels(int levels);
}

namespace lodestone {

/// While it exists, OpenMP regions that the calling thread enters run on this thread alone, and so does BLAS. CHOLMOD's
/// supernodal factorization of a window is so small that waking threads takes longer than the work.
class SerialOpenMp {
 public:
  SerialOpenMp() : levels_(omp_get_max_active_levels()) {
    [[maybe_unused]] static const bool limited = (limit_blas(), true);
    omp_set_max_active_levels(0);
  }
  ~SerialOpenMp() { omp_set_max_active_levels(levels_); }
  SerialOpenMp(const SerialOpenMp&) = delete;
  SerialOpenMp& operator=(const SerialOpenMp&) = delete;

 private:
  int levels_;
};

}  // namespace lodestone
