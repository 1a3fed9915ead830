#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace lodestone::reproduce {

/// Progress of a plan.
struct WorkShare {
  std::size_t done = 0;  ///< finished steps
  std::size_t total = 0;
  double share = 0.0;  ///< of the expected time, 0 to 1
  double seconds_left = 0.0;
  std::string active;  ///< names of the running steps
};

/// On a terminal: a bar that is redrawn, with steps per hour, time left and the running steps. Elsewhere: a plain line
/// per step and no bar.
class WorkProgress {
 public:
  explicit WorkProgress(std::FILE* stream);
  ~WorkProgress();
  WorkProgress(const WorkProgress&) = delete;
  WorkProgress& operator=(const WorkProgress&) = delete;

  /// Redraws the bar, at most a few times per second.
  void update(const WorkShare& work);

  /// Prints `text` about a finished step on its own line.
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
