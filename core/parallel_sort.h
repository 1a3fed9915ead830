#pragma once

#include "core/parallel.h"

#ifdef LODESTONE_THREAD_SANITIZER
#include <algorithm>
#else
#include <tbb/parallel_sort.h>
#endif

namespace lodestone {

/// Sorts on all cores. Values that compare equal may come in any order: only for those whose order is total. TBB's own
/// moves of values between threads are hidden from ThreadSanitizer, which gets the sort of one thread.
template <class Iterator>
void parallel_sort(Iterator first, Iterator last) {
#ifdef LODESTONE_THREAD_SANITIZER
  std::sort(first, last);
#else
  tbb::parallel_sort(first, last);
#endif
}

}  // namespace lodestone
