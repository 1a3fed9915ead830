#pragma once

#include <memory>

namespace lodestone {

/// Limits the number of threads during its lifetime (0: all of the machine). BLAS always has one thread: with more, its
/// sums, and so the results, would depend on the machine.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

}  // namespace lodestone
