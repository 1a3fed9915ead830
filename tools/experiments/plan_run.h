#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/plan.h"
#include "tools/experiments/scheduler.h"

namespace lodestone::reproduce {

struct WorkOptions {
  std::string out;           ///< the output folder
  bool any_build = false;    ///< what another build of the program made counts as done
  std::optional<int> jobs;   ///< steps at a time; nothing: one a core, at most 4
  bool keep_fields = false;  ///< magnetic maps stay when the runs are done: further calls in the folder take them again
};

/// An experiment's steps, done in an output folder that is locked as long as this lives.
class PlanRun {
 public:
  /// Plans, and opens the folder. Throws InputError where an option, a pattern, a world, sequence or scene is wrong, or
  /// the folder is locked.
  PlanRun(const Experiment& experiment, const WorkOptions& options);

  /// Tells how much there is to do and does it (Scheduler::run). Throws Interrupted on a signal.
  void run();

  const Plan& plan() const { return plan_; }
  const std::filesystem::path& root() const { return store_->root(); }

  /// One entry a run of the plan.
  std::vector<bool> done() const;
  std::vector<std::string> status() const;  ///< done, failed, missing

  /// Done, or, with a line on standard error, input_error where a step failed.
  int exit_code() const;

 private:
  std::size_t count(StepState state) const;

  std::string file_;
  ScheduleOptions schedule_;
  Plan plan_;
  std::unique_ptr<StepStore> store_;
  std::unique_ptr<Scheduler> scheduler_;
};

}  // namespace lodestone::reproduce
