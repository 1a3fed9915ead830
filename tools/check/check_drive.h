#pragma once

#include <memory>
#include <optional>
#include <string>

#include "estimators/factory.h"
#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"
#include "tools/check/start_checks.h"

namespace lodestone {

/// The log's begin driven through the maps, as a run would.
struct CheckDrive {
  std::string log;
  Platform platform;
  RunOptions options;
  std::shared_ptr<const PlaneMapSource> planes;  ///< may be null
  std::shared_ptr<const MagneticMap> field;      ///< may be null
  double seconds = 0.0;

  /// `--initial-pose auto`; where it fails, why is added to `findings`.
  std::optional<Pose> find_start(Findings& findings) const;

  /// Looks for the first scans all over the cloud map.
  std::optional<PlaceOnMap> find_anywhere() const;

  /// Runs the smoother from `start` and looks at what it says: lost or not, how much of the scans fits, how
  /// accelerometer and magnetometers go with the way driven. `before`: what was found already.
  Findings check(const Pose& start, const LogSample& sample, const Findings& before) const;

 private:
  EstimatorInput input(const Pose& start, WarningLog* warnings) const;
};

}  // namespace lodestone
