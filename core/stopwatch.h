#pragma once

#include <chrono>

namespace lodestone {

/// Wall time since its construction. For reports only: no result depends on it.
class Stopwatch {
 public:
  double elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
  double elapsed_ms() const { return 1e3 * elapsed_s(); }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace lodestone
