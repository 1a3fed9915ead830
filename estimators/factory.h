#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/lidar/scan_matcher.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "estimators/estimator.h"
#include "estimators/options.h"

namespace lodestone {

/// The input of every estimator. All get the same sensors, maps and options, so that comparisons differ in the
/// estimator only.
struct EstimatorInput {
  SensorSuite suite;
  std::shared_ptr<const PlaneMapSource> planes;  ///< null: no LiDAR localization
  std::shared_ptr<const MagneticMap> field;      ///< null: no magnetic localization
  Pose initial_pose;                             ///< T_map_imu at the first scan's start
  Vector3 initial_velocity = Vector3::Zero();    ///< of imu at that time, map axes, m/s
  RunOptions options;
  WarningLog* warnings = nullptr;            ///< counts data that the estimator discards; must outlive the estimator
  const Trajectory* linearize_at = nullptr;  ///< not null: nothing is solved; covariances are those at these poses
  std::function<bool(double)> refining;      ///< gets the finished share of a refinement; false stops it; may be empty
  std::shared_ptr<ScanMatcher> matcher{};    ///< of the cloud map, for estimator ndt; null: other estimators only
};

/// Names of all estimators, the default first.
std::vector<std::string> estimator_names();

/// Whether the estimator uses magnetometers, if there is a field map. The others never see the map: neither does the
/// search after a loss.
bool uses_field(const std::string& name);

/// Whether the estimator requires EstimatorInput::matcher.
bool needs_scan_matcher(const std::string& name);

/// Whether the estimator supports refinement over the whole log (`smoother.refine`).
bool can_refine(const std::string& name);

/// Throws InputError if the name is unknown (the message suggests the closest one) or if the input lacks a map that the
/// estimator requires.
std::unique_ptr<Estimator> make_estimator(const std::string& name, const EstimatorInput& input);

}  // namespace lodestone
