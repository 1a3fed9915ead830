#pragma once

#include <vector>

#include "tools/simulate/world.h"

namespace lodestone::simulation {

/// A smooth planar curve by its length: the polyline through way-points, corners rounded, then smoothed by a Gaussian
/// (so that curvature changes gradually). Beyond both ends it goes straight on.
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

/// Where the base of the robot shall be, every `plan_step_s`: the input of Motion.
struct PlannedPose {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double heading = 0.0;  ///< rad, unwrapped
  double speed = 0.0;    ///< m/s, negative when reversing
};
constexpr double plan_step_s = 0.02;

/// What a plan asks of the motors.
struct DriveCommand {
  double acceleration_m_s2 = 0.0;  ///< forwards
  double yaw_rate_rad_s = 0.0;
};

/// At so many seconds of the Motion that is made of `plan`; held within its ends.
DriveCommand command_at(const std::vector<PlannedPose>& plan, double seconds);

/// One sequence: rest, drive along the route by its speed profile (limits of acceleration and yaw rate kept, jerk
/// smoothed), rest.
std::vector<PlannedPose> plan_drive(const Sequence& sequence);

/// The survey of a sequence: its route (or that of its survey_waypoints) once per lane, at the lane's lateral offset,
/// forwards and backwards in turn without turning round. Lanes change by a smooth shift over the first metres.
std::vector<PlannedPose> plan_survey(const Sequence& sequence, const SurveyOptions& survey);

}  // namespace lodestone::simulation
