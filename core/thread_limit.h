#pragma once

#include <memory>
#include <string>

namespace lodestone {

/// The BLAS that the process has loaded, with the kernels that it chose for this processor: "OpenBLAS 0.3.21, Zen". The
/// last bits of results depend on both. Empty: not OpenBLAS.
std::string blas_description();

/// Limits OpenBLAS to one thread a call: with more, its sums, and so the results, would depend on the machine. Throws
/// InputError if OpenBLAS was built without threads: then it is not safe to call from several threads.
void limit_blas();

/// Threads that a loop of parallel_for may use now.
int usable_threads();

/// Limits the number of threads during its lifetime (0: all of the machine), and those of BLAS.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

}  // namespace lodestone
