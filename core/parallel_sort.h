#pragma once

#include "core/parallel.h"

#ifdef LODESTONE_THREAD_SANITIZER
#include <algorithm>
#else
#include <tbb/parallel_sort.h>
#endif

namespace lodestone {

/// Sorts on all cores. The order of equal values is undefined: only for values with a total order. ThreadSanitizer does
/// not see TBB's moves of values between threads; with it the sort runs on one thread.
template <class Iterator>
void parallel_sort(Iterator first, Iterator last) {
#ifdef LODESTONE_THREAD_SANITIZER
  std::sort(first, last);
#else
  tbb::parallel_sort(first, last);
#endif
}

}  // namespace lodestone
