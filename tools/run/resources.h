#pragma once

#include <memory>

namespace lodestone {

/// Starts a new measurement of the process's peak memory, so that each estimator is told its own. Where the kernel does
/// not allow that the peak stays that of the whole process.
void reset_peak_memory();

/// Peak resident memory since `reset_peak_memory` or the start, MB (10⁶ bytes); 0 where it cannot be known.
double peak_memory_mb();

/// While it lives at most `threads` threads work (0: as many as the machine has). BLAS gets one thread always: with
/// more its sums, and so the results, would depend on the machine.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

}  // namespace lodestone
