#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/plan.h"
#include "tools/experiments/workflow.h"

namespace lodestone::reproduce {

struct WorkOptions {
  std::string out;           ///< the output folder
  bool any_build = false;    ///< accept finished steps of another build of the program
  std::optional<int> jobs;   ///< steps at a time; nothing: one per core, at most 4
  std::string profile;       ///< folder of a Snakemake profile, for a cluster; empty: this machine
  bool keep_fields = false;  ///< keep magnetic maps after the runs, for further calls in this folder
};

/// Throws InputError if a world of these runs cannot be read, or lacks a sequence or a scene.
void check_worlds(const Experiment& experiment, const std::vector<Run>& runs);

/// Runs an experiment's steps in an output folder, which is locked during the lifetime of this object.
class PlanRun {
 public:
  /// Makes the plan, and opens the folder. Throws InputError if an option, a pattern, a world, sequence or scene is
  /// wrong, or if the folder is locked.
  PlanRun(const Experiment& experiment, const WorkOptions& options);

  /// Logs the amount of work and runs it (Workflow::run). Throws Interrupted on a signal.
  void run();

  const Plan& plan() const { return plan_; }
  const std::filesystem::path& root() const { return store_->root(); }

  /// One entry per run of the plan.
  std::vector<bool> done() const;
  std::vector<std::string> status() const;  ///< done, failed, missing

  /// done; or input_error, with a line on standard error, if a step failed.
  int exit_code() const;

 private:
  std::string file_;
  WorkflowOptions work_options_;
  Plan plan_;
  std::unique_ptr<StepStore> store_;
  std::unique_ptr<Workflow> workflow_;
};

}  // namespace lodestone::reproduce
