#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tools/experiments/step_store.h"
#include "tools/experiments/step_times.h"
#include "tools/experiments/work_progress.h"

namespace lodestone::reproduce {

enum class StepState {
  unneeded,  ///< everything that would need it is done
  done,
  waiting,
  active,
  failed,
  blocked,  ///< something it needs has failed
};

struct ScheduleOptions {
  std::string program = "/proc/self/exe";  ///< stays this very program even where its file is replaced meanwhile
  int jobs = 2;                            ///< steps at a time
  int threads = 1;                         ///< of each
  std::FILE* progress = stderr;
};

/// Does what is missing of a plan.
class Scheduler {
 public:
  Scheduler(const Plan& plan, const StepStore& store, ScheduleOptions options);

  /// State of every step before anything is done: what is done, unneeded or waiting.
  const std::vector<StepState>& states() const { return states_; }

  /// Runs every waiting step as soon as what it needs is done, `jobs` at a time, and removes files that nothing needs
  /// any more. A step that fails is told in one line; the others go on. On a signal the children are stopped and
  /// Interrupted is thrown; what is done stays.
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
  std::vector<bool> was_done_;  ///< before `run`
  std::vector<std::vector<std::size_t>> dependents_;
  StepTimes times_;
  WorkProgress progress_;
};

}  // namespace lodestone::reproduce
