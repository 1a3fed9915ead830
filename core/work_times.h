#pragma once

#include <array>
#include <cstddef>

namespace lodestone {

/// Kinds of work whose times a run reports.
enum class Work : std::size_t {
  read,         ///< decode the log, deskew
  sample,       ///< choose points of a scan
  associate,    ///< match points with planes, condense them to a cost
  weigh,        ///< analyse degeneracy, weigh the field
  solve,        ///< linearize and solve the window
  covariance,   ///< covariances, noise from residuals
  marginalize,  ///< remove the oldest keyframe
  estimate,     ///< the rest of an estimator's step
  health,       ///< judge the estimate, search for a lost robot
  write,        ///< result files
};

inline constexpr std::array<const char*, 10> kWorkNames{"read",       "sample",      "associate", "weigh",  "solve",
                                                        "covariance", "marginalize", "estimate",  "health", "write"};

/// Seconds of wall time for each kind of work.
using WorkTimes = std::array<double, kWorkNames.size()>;

/// Counts its own life as work of the calling thread, less that of timers within. For reports only: no result depends
/// on it.
class WorkTimer {
 public:
  explicit WorkTimer(Work work);
  ~WorkTimer();
  WorkTimer(const WorkTimer&) = delete;
  WorkTimer& operator=(const WorkTimer&) = delete;

 private:
  WorkTimer* outer_;
  std::size_t work_;
};

/// Of the calling thread since it began.
const WorkTimes& work_times();

}  // namespace lodestone
