#pragma once

#include <optional>
#include <string>

#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// What `lodestone check` was asked for, as on its command line; empty strings where nothing was given.
struct CheckCall {
  std::string log;
  std::string platform;
  std::string cloud;
  std::string magnetic;
  std::string initial_pose;
  std::string initial_pose_from;
  double seconds = 30.0;
  std::string out;
  std::optional<int> threads;
};

/// What was looked at and what was found, worst first.
struct CheckResult {
  LogSample sample;
  Findings findings;
};

/// Looks at a log's begin. Throws InputError where the call, the platform file or a map is wrong, or the file is no
/// log.
CheckResult check_log(const CheckCall& call);

/// check_log, printed and written to call.out. Returns the exit code: 2 where something is an error.
int execute(const CheckCall& call);

}  // namespace lodestone
