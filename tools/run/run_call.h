#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lodestone {

/// What `lodestone run` was asked for, as on its command line; empty strings where nothing was given.
struct RunCall {
  std::string log;
  std::string platform;
  std::string cloud;
  std::string magnetic;
  std::string out;
  std::vector<std::string> estimators{"smoother"};
  std::string initial_pose;
  std::string initial_pose_from;
  std::vector<std::string> configurations;
  std::vector<std::string> settings;
  std::optional<double> max_range_m;  ///< nothing: as the platform says
  std::optional<int> threads;         ///< nothing: as many as the machine has
  std::string truth;
  std::string calibration_truth;
  bool bound = false;          ///< what accuracy the sensors allow, too
  double check_seconds = 5.0;  ///< of the log's begin are looked at beforehand; 0: none
  bool resume = false;         ///< keep the estimators that had ended
  std::string refine;          ///< none or batch; empty: as the configuration says
};

/// Runs every estimator over the log and writes everything (docs/design/architecture.md). Returns the exit code. Throws
/// InputError where the call or a file is wrong.
int execute(const RunCall& call);

}  // namespace lodestone
