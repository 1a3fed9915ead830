#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// The options of `lodestone run`; empty strings if not given.
struct RunCall {
  std::string log;
  std::string platform;
  std::string cloud;
  std::string magnetic;
  std::string out;
  std::vector<std::string> estimators{"smoother"};
  Vector3 origin_m = Vector3::Zero();  ///< subtracted from maps, truth and initial pose
  std::string initial_pose;
  std::string initial_pose_from;
  std::vector<std::string> configurations;
  std::vector<std::string> settings;
  std::optional<double> max_range_m;  ///< nothing: the platform's range
  std::optional<int> threads;         ///< nothing: all of the machine
  std::string truth;
  std::string calibration_truth;
  bool bound = false;          ///< also compute the bound
  double check_seconds = 5.0;  ///< checked part of the log; 0: no check
  bool resume = false;         ///< keep finished estimators
  std::string refine;          ///< none or batch; empty: as in the configuration
};

/// Runs every estimator over the log and writes all results. Returns the exit code. Throws InputError if the call or a
/// file is wrong.
int execute(const RunCall& call);

}  // namespace lodestone
