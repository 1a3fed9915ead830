#pragma once

#include <optional>
#include <string>

#include "core/geometry/so3.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// The options of `lodestone check`; empty strings if not given.
struct CheckCall {
  std::string log;
  std::string platform;
  std::string cloud;
  std::string magnetic;
  Vector3 origin_m = Vector3::Zero();  ///< subtracted from maps and the initial pose
  std::string initial_pose;
  std::string initial_pose_from;
  double seconds = 30.0;
  std::string out;
  std::optional<int> threads;
};

/// The sample and the findings, worst first.
struct CheckResult {
  LogSample sample;
  Findings findings;
};

/// Checks the first seconds of a log. Throws InputError if the call, the platform file or a map is wrong, or if the
/// file is not a log.
CheckResult check_log(const CheckCall& call);

/// Runs check_log, prints the result and writes call.out. Returns the exit code: 2 if a finding is an error.
int execute(const CheckCall& call);

}  // namespace lodestone
