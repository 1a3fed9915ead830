#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "estimators/estimator.h"
#include "estimators/options.h"

namespace lodestone {

/// What every estimator is made of: the same sensors, maps and options, so that an A/B compares estimators alone.
struct EstimatorInput {
  SensorSuite suite;
  std::shared_ptr<const PlaneMapSource> planes;  ///< null: no LiDAR localization
  std::shared_ptr<const MagneticMap> field;      ///< null: no magnetic localization
  Pose initial_pose;                             ///< T_map_imu at the first scan's start
  Vector3 initial_velocity = Vector3::Zero();    ///< of imu at that time, map axes, m/s
  RunOptions options;
  WarningLog* warnings = nullptr;            ///< counts what an estimator had to leave out; must outlive it
  const Trajectory* linearize_at = nullptr;  ///< not null: nothing is solved, covariances are those at these poses
  std::function<bool(double)> refining;  ///< told the share of a refinement that is done; false ends it; may be empty
};

/// Names that make_estimator knows, the default first.
std::vector<std::string> estimator_names();

/// Whether an estimator of that name can be refined over the whole log at its end (`smoother.refine`).
bool can_refine(const std::string& name);

/// Throws InputError where the name is unknown (with the closest one) or where the input lacks what the estimator
/// needs.
std::unique_ptr<Estimator> make_estimator(const std::string& name, const EstimatorInput& input);

}  // namespace lodestone
