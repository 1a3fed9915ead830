#pragma once

#include <string>
#include <vector>

#include "tools/experiments/step_store.h"

namespace lodestone::reproduce {

enum class StepState {
  unneeded,  ///< all dependents are done
  done,
  waiting,
  failed,
  blocked,  ///< a required step has failed
};

struct WorkflowOptions {
  int jobs = 2;         ///< steps at a time; with a profile, 0: as the profile says
  int threads = 1;      ///< per step
  std::string profile;  ///< folder of a Snakemake profile, for a cluster; empty: this machine
};

/// Runs the missing steps of a plan with Snakemake (tools/fleet/experiment.smk).
class Workflow {
 public:
  Workflow(const Plan& plan, const StepStore& store, WorkflowOptions options);

  /// State of every step: before run() done, unneeded or waiting.
  const std::vector<StepState>& states() const { return states_; }

  /// Runs every waiting step when its requirements are done, and removes files that no step needs any more. A failed
  /// step is reported in one line; other steps continue. On a signal, the steps are stopped and Interrupted is thrown;
  /// finished steps are kept. Throws InputError if Snakemake cannot be started, or ends before the first step.
  void run();

  bool all_done() const;
  std::size_t count(StepState state) const;

 private:
  std::string steps_file() const;
  std::vector<std::string> command() const;
  std::string program() const;
  void conclude(const std::string& end);

  const Plan& plan_;
  const StepStore& store_;
  WorkflowOptions options_;
  std::vector<StepState> states_;
  std::vector<std::vector<std::size_t>> dependents_;
};

}  // namespace lodestone::reproduce
