#pragma once

#include <vector>

#include "tools/simulate/world.h"

namespace lodestone::simulation {

/// A smooth planar curve, parametrized by length: the polyline through way-points with rounded corners, smoothed by a
/// Gaussian (so that curvature changes gradually). Beyond both ends the curve is straight.
class Route {
 public:
  Route(const std::vector<Eigen::Vector2d>& waypoints, double corner_radius_m);

  struct Place {
    Eigen::Vector2d position;  ///< map, m
    double heading = 0.0;      ///< rad, unwrapped
    double curvature = 0.0;    ///< 1/m, positive to the left
  };
  Place at(double distance) const;
  double length() const { return length_; }

 private:
  std::vector<Place> places_;  ///< every `step`
  double length_ = 0.0;
};

/// Planned pose of the robot's base, every `plan_step_s`: the input of Motion.
struct PlannedPose {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double heading = 0.0;  ///< rad, unwrapped
  double speed = 0.0;    ///< m/s, negative when reversing
};
constexpr double plan_step_s = 0.02;

/// Commanded motion of the motors.
struct DriveCommand {
  double acceleration_m_s2 = 0.0;  ///< forwards
  double yaw_rate_rad_s = 0.0;
};

/// Command at `seconds` of the Motion that is made from `plan`; clamped to its ends.
DriveCommand command_at(const std::vector<PlannedPose>& plan, double seconds);

/// One sequence: rest, drive along the route with its speed profile (limits of acceleration and yaw rate are respected,
/// jerk is smoothed), rest.
std::vector<PlannedPose> plan_drive(const Sequence& sequence);

/// The survey of a sequence: its route (or that of survey_waypoints) once per lane, at the lane's lateral offset,
/// forwards and backwards in turn without turning round. The robot changes lanes by a smooth shift over the first
/// metres.
std::vector<PlannedPose> plan_survey(const Sequence& sequence, const SurveyOptions& survey);

}  // namespace lodestone::simulation
