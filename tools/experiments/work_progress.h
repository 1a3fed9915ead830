#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace lodestone::reproduce {

/// How far a plan has come.
struct WorkShare {
  std::size_t done = 0;  ///< steps
  std::size_t total = 0;
  double share = 0.0;  ///< of the expected time, 0 to 1
  double seconds_left = 0.0;
  std::string active;  ///< what is being done
};

/// On a terminal a bar that is redrawn, with steps an hour, the time left and what is being done; elsewhere a plain
/// line a step and no bar.
class WorkProgress {
 public:
  explicit WorkProgress(std::FILE* stream);
  ~WorkProgress();
  WorkProgress(const WorkProgress&) = delete;
  WorkProgress& operator=(const WorkProgress&) = delete;

  /// Redraws the bar, a few times a second at most.
  void update(const WorkShare& work);

  /// `text` about a step that ended, in a line of its own.
  void tell(const WorkShare& work, const std::string& text);

  /// Removes the bar. The destructor calls it.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;

  std::FILE* stream_;
  bool terminal_;
  bool open_line_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
};

}  // namespace lodestone::reproduce
