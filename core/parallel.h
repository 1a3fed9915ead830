#pragma once

#include <cstddef>

#if defined(__SANITIZE_THREAD__)
#define LODESTONE_THREAD_SANITIZER
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define LODESTONE_THREAD_SANITIZER
#endif
#endif

#ifdef LODESTONE_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

/// Loops on all cores. In core, only this loop uses TBB. TBB is not built with ThreadSanitizer, which therefore does
/// not know that a loop's body runs between the caller's code before and after the loop. LoopOrder states this order
/// and no more: two bodies stay unordered, so that races between them are still reported.
namespace lodestone {

/// Work on [first, last), without its type: TBB's headers stay in one .cpp file.
struct RangeWork {
  void (*call)(const void* loop, std::size_t first, std::size_t last);
  const void* loop;
};

/// Divides [0, count) into pieces and runs them in parallel. An exception from a piece is rethrown here, after all
/// pieces have ended.
void run_ranges(std::size_t count, std::size_t grain, const RangeWork& work);

/// The order of one loop, for ThreadSanitizer.
class LoopOrder {
 public:
#ifdef LODESTONE_THREAD_SANITIZER
  LoopOrder() {
    __tsan_release(&begun_);
  }
  ~LoopOrder() {
    __tsan_acquire(&ended_);
  }
  void begin_piece() {
    __tsan_acquire(&begun_);
  }
  void end_piece() {
    __tsan_release(&ended_);
  }

 private:
  // Two addresses: with one alone, the end of a piece would be ordered before the beginning of another.
  char begun_ = 0;
  char ended_ = 0;
#else
  void begin_piece() {}
  void end_piece() {}
#endif
};

/// `body(index)` for every index in [first, last), in parallel. `grain`: the smallest number of indices that is worth a
/// piece of work.
template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body, std::size_t grain = 1) {
  if (!(first < last)) return;
  struct Loop {
    const Body& body;
    Index first;
    mutable LoopOrder order;
  };
  struct Piece {
    LoopOrder& order;
    explicit Piece(LoopOrder& order_in) : order(order_in) { order.begin_piece(); }
    ~Piece() { order.end_piece(); }
  };
  const Loop loop{body, first, {}};
  const auto work = [](const void* erased, std::size_t begin, std::size_t end) {
    const Loop& called = *static_cast<const Loop*>(erased);
    const Piece piece(called.order);
    for (std::size_t i = begin; i != end; ++i) called.body(static_cast<Index>(called.first + static_cast<Index>(i)));
  };
  run_ranges(static_cast<std::size_t>(last - first), grain, {work, &loop});
}

}  // namespace lodestone
