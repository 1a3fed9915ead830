#pragma once

#include <optional>
#include <string>

#include "localization/site.h"
#include "tools/check/finding.h"
#include "tools/check/initial_pose_checks.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Runs the smoother on the checked part of the log with the maps.
struct CheckDrive {
  std::string log;
  Site site;
  double seconds = 0.0;

  /// The search of `--initial-pose auto`. If it fails, the reason is added to `findings`.
  std::optional<Pose> find_start(Findings& findings) const;

  /// Searches the whole cloud map for the first scans.
  std::optional<PlaceOnMap> find_anywhere() const;

  /// Runs the smoother from `start`: whether it is lost, the share of correspondences, and the residuals of
  /// accelerometer and magnetometers along the path. `before`: the findings so far.
  Findings check(const Pose& start, const LogSample& sample, const Findings& before) const;
};

}  // namespace lodestone
