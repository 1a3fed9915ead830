#include "core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace lodestone {

void run_ranges(std::size_t count, std::size_t grain, const RangeWork& work) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, grain),
      [&](const tbb::blocked_range<std::size_t>& range) { work.call(work.loop, range.begin(), range.end()); });
}

}  // namespace lodestone
