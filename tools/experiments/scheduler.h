#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tools/experiments/step_store.h"
#include "tools/experiments/step_times.h"
#include "tools/experiments/work_progress.h"

namespace lodestone::reproduce {

enum class StepState {
  unneeded,  ///< all dependents are done
  done,
  waiting,
  active,
  failed,
  blocked,  ///< a required step has failed
};

struct ScheduleOptions {
  std::string program = "/proc/self/exe";  ///< this program, even if its file is replaced meanwhile
  int jobs = 2;                            ///< steps at a time
  int threads = 1;                         ///< per step
  std::FILE* progress = stderr;
};

/// Runs the missing steps of a plan.
class Scheduler {
 public:
  Scheduler(const Plan& plan, const StepStore& store, ScheduleOptions options);

  /// State of every step before run(): done, unneeded or waiting.
  const std::vector<StepState>& states() const { return states_; }

  /// Runs every waiting step when its requirements are done, `jobs` at a time, and removes files that no step needs any
  /// more. A failed step is reported in one line; other steps continue. On a signal, the children are stopped and
  /// Interrupted is thrown; finished steps are kept.
  void run();

  bool all_done() const;

 private:
  struct Active;
  void start_ready(std::vector<Active>& active);
  void advance(Active& active);
  bool is_ready(std::size_t index) const;
  bool may_open_another_log() const;
  void conclude(const Active& active, int code);
  WorkShare share(const std::vector<Active>& active) const;
  void block_dependents(std::size_t index);
  void remove_unneeded();
  std::string last_line(const Step& step) const;

  const Plan& plan_;
  const StepStore& store_;
  ScheduleOptions options_;
  std::vector<StepState> states_;
  std::vector<bool> was_done_;  ///< before run()
  std::vector<std::vector<std::size_t>> dependents_;
  StepTimes times_;
  WorkProgress progress_;
};

}  // namespace lodestone::reproduce
