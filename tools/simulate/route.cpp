#include "tools/simulate/route.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lodestone::simulation {
namespace {

constexpr double route_step = 0.01;       // m
constexpr double route_smoothing = 0.35;  // m, one sigma
constexpr double run_out = 3.0;  // m of straight line beyond both ends, so that smoothing does not move the ends

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double wrapped(double angle) {
  return std::remainder(angle, 2.0 * std::numbers::pi);
}

/// The polyline with every corner replaced by an arc, sampled about every route_step.
std::vector<Eigen::Vector2d> round_corners(const std::vector<Eigen::Vector2d>& corners, double radius) {
  std::vector<Eigen::Vector2d> samples{corners.front()};
  const auto line_to = [&](const Eigen::Vector2d& end) {
    const Eigen::Vector2d start = samples.back();
    const int count = std::max(1, static_cast<int>(std::ceil((end - start).norm() / route_step)));
    for (int i = 1; i <= count; ++i) samples.push_back(start + (end - start) * (static_cast<double>(i) / count));
  };
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Eigen::Vector2d in = corners[i] - corners[i - 1], out = corners[i + 1] - corners[i];
    const double turn = std::atan2(cross(in, out), in.dot(out));
    const double half_tangent = std::tan(0.5 * std::abs(turn));
    if (half_tangent < 1e-9) continue;
    // An arc uses at most half of each leg: neighbouring arcs never overlap.
    const double tangent = std::min({radius * half_tangent, 0.5 * in.norm(), 0.5 * out.norm()});
    const double arc_radius = tangent / half_tangent;
    const Eigen::Vector2d start = corners[i] - in.normalized() * tangent;
    line_to(start);
    const Eigen::Vector2d forward = in.normalized();
    const Eigen::Vector2d left(-forward.y(), forward.x());
    const double side = turn > 0.0 ? 1.0 : -1.0;
    const int count = std::max(1, static_cast<int>(std::ceil(arc_radius * std::abs(turn) / route_step)));
    for (int k = 1; k <= count; ++k) {
      const double angle = std::abs(turn) * k / count;
      samples.push_back(start + arc_radius * (std::sin(angle) * forward + side * (1.0 - std::cos(angle)) * left));
    }
  }
  line_to(corners.back());
  return samples;
}

/// Points at equal steps of length along a dense polyline.
std::vector<Eigen::Vector2d> resample(const std::vector<Eigen::Vector2d>& dense) {
  std::vector<Eigen::Vector2d> samples{dense.front()};
  double next = route_step, travelled = 0.0;
  for (std::size_t i = 1; i < dense.size(); ++i) {
    const double leg = (dense[i] - dense[i - 1]).norm();
    for (; next <= travelled + leg && leg > 0.0; next += route_step)
      samples.push_back(dense[i - 1] + (dense[i] - dense[i - 1]) * ((next - travelled) / leg));
    travelled += leg;
  }
  return samples;
}

/// Gaussian smoothing. Beyond its ends the data is mirrored through the end point: straight ends do not move.
template <class Value>
std::vector<Value> gaussian_smoothed(const std::vector<Value>& values, double sigma_samples) {
  const int half = static_cast<int>(std::ceil(4.0 * sigma_samples));
  std::vector<double> kernel(2 * half + 1);
  double sum = 0.0;
  for (int k = -half; k <= half; ++k) sum += kernel[k + half] = std::exp(-0.5 * std::pow(k / sigma_samples, 2));
  const int last = static_cast<int>(values.size()) - 1;
  const auto value_at = [&](int i) -> Value {
    if (i < 0) return 2.0 * values.front() - values[std::min(-i, last)];
    if (i > last) return 2.0 * values.back() - values[std::max(2 * last - i, 0)];
    return values[i];
  };
  std::vector<Value> result;
  result.reserve(values.size());
  for (int i = 0; i <= last; ++i) {
    Value value = values[i] * 0.0;
    for (int k = -half; k <= half; ++k) value += value_at(i + k) * (kernel[k + half] / sum);
    result.push_back(value);
  }
  return result;
}

}  // namespace

Route::Route(const std::vector<Eigen::Vector2d>& waypoints, double corner_radius_m) {
  std::vector<Eigen::Vector2d> corners = waypoints;
  const std::size_t last = corners.size() - 1;
  corners.front() -= (waypoints[1] - waypoints[0]).normalized() * run_out;
  corners.back() += (waypoints[last] - waypoints[last - 1]).normalized() * run_out;
  auto points = gaussian_smoothed(resample(round_corners(corners, corner_radius_m)), route_smoothing / route_step);
  points = resample(points);
  const int margin = static_cast<int>(run_out / route_step);
  const int count = static_cast<int>(points.size());
  double heading = 0.0;
  for (int i = margin; i < count - margin; ++i) {
    const Eigen::Vector2d ahead = points[i + 1] - points[i - 1];
    const Eigen::Vector2d before = points[i] - points[i - 1], after = points[i + 1] - points[i];
    const double direction = std::atan2(ahead.y(), ahead.x());
    heading = places_.empty() ? direction : heading + wrapped(direction - heading);
    places_.push_back({points[i], heading, std::atan2(cross(before, after), before.dot(after)) / route_step});
  }
  length_ = (static_cast<double>(places_.size()) - 1.0) * route_step;
}

Route::Place Route::at(double distance) const {
  const auto straight = [](Place place, double beyond) {
    place.position += beyond * Eigen::Vector2d(std::cos(place.heading), std::sin(place.heading));
    place.curvature = 0.0;
    return place;
  };
  if (distance <= 0.0) return straight(places_.front(), distance);
  if (distance >= length_) return straight(places_.back(), distance - length_);
  const auto index = std::min(static_cast<std::size_t>(distance / route_step), places_.size() - 2);
  const double share = distance / route_step - static_cast<double>(index);
  const Place &a = places_[index], &b = places_[index + 1];
  return {a.position + share * (b.position - a.position), a.heading + share * (b.heading - a.heading),
          a.curvature + share * (b.curvature - a.curvature)};
}

namespace {

constexpr double lateral_acceleration = 1.0;  // m/s², comfortable for a ground robot
constexpr double jerk_smoothing_s = 0.15;     // one sigma in time
constexpr double lane_change_m = 4.0;
constexpr double survey_rest_s = 1.0;

double profile_speed(const std::vector<SpeedPoint>& profile, double distance) {
  if (distance <= profile.front().distance_m) return profile.front().speed_m_s;
  for (std::size_t i = 1; i < profile.size(); ++i) {
    const SpeedPoint &a = profile[i - 1], &b = profile[i];
    if (distance > b.distance_m) continue;
    const double length = b.distance_m - a.distance_m;
    const double share = length > 0.0 ? (distance - a.distance_m) / length : 1.0;
    return a.speed_m_s + share * (b.speed_m_s - a.speed_m_s);
  }
  return profile.back().speed_m_s;
}

struct Leg {
  double begin = 0.0;          ///< distance on the route, m
  double end = 0.0;            ///< smaller than begin: driven backwards
  double offset_before = 0.0;  ///< lateral, m
  double offset = 0.0;
};

/// Travelled distances on a leg every plan_step_s, from rest to rest, within the limits.
std::vector<double> time_leg(const Route& route, const Leg& leg, const std::vector<SpeedPoint>& profile,
                             double acceleration, double max_yaw_rate) {
  const double length = std::abs(leg.end - leg.begin);
  const double direction = leg.end >= leg.begin ? 1.0 : -1.0;
  const auto count = static_cast<std::size_t>(std::max(2.0, std::ceil(length / route_step)));
  const double step = length / static_cast<double>(count);
  std::vector<double> speed(count + 1);
  for (std::size_t i = 0; i <= count; ++i) {
    const double distance = leg.begin + direction * step * static_cast<double>(i);
    const double curvature = std::abs(route.at(distance).curvature) + 1e-9;
    speed[i] = std::min(
        {profile_speed(profile, distance), max_yaw_rate / curvature, std::sqrt(lateral_acceleration / curvature)});
  }
  speed.front() = speed.back() = 0.0;
  const double gain = 2.0 * acceleration * step;
  for (std::size_t i = 1; i <= count; ++i) speed[i] = std::min(speed[i], std::sqrt(speed[i - 1] * speed[i - 1] + gain));
  for (std::size_t i = count; i-- > 0;) speed[i] = std::min(speed[i], std::sqrt(speed[i + 1] * speed[i + 1] + gain));

  std::vector<double> travelled{0.0};
  double time = 0.0, next = plan_step_s;
  for (std::size_t i = 1; i <= count; ++i) {
    const double duration = 2.0 * step / (speed[i - 1] + speed[i]);
    const double rate = (speed[i] - speed[i - 1]) / duration;
    for (; next <= time + duration; next += plan_step_s) {
      const double t = next - time;
      travelled.push_back(step * static_cast<double>(i - 1) + t * (speed[i - 1] + 0.5 * rate * t));
    }
    time += duration;
  }
  travelled.push_back(length);
  return travelled;
}

std::vector<PlannedPose> plan(const Route& route, const std::vector<Leg>& legs, const std::vector<SpeedPoint>& profile,
                              double acceleration, double max_yaw_rate, double first_rest_s, double rest_s) {
  std::vector<PlannedPose> poses;
  const auto steps = [](double seconds) { return static_cast<std::size_t>(std::ceil(seconds / plan_step_s)); };
  for (std::size_t index = 0; index < legs.size(); ++index) {
    const Leg& leg = legs[index];
    const double direction = leg.end >= leg.begin ? 1.0 : -1.0;
    auto travelled = time_leg(route, leg, profile, acceleration, max_yaw_rate);
    travelled.insert(travelled.begin(), steps(index == 0 ? first_rest_s : 0.5 * rest_s), 0.0);
    travelled.insert(travelled.end(), steps(0.5 * rest_s), travelled.back());
    travelled = gaussian_smoothed(travelled, jerk_smoothing_s / plan_step_s);
    for (std::size_t i = 0; i < travelled.size(); ++i) {
      const Route::Place place = route.at(leg.begin + direction * travelled[i]);
      // The shift to this leg's lane: a quintic with zero slope and curvature at both ends.
      const double t = std::clamp((travelled[i] - 0.5) / lane_change_m, 0.0, 1.0);
      const double change = leg.offset - leg.offset_before;
      const double offset = leg.offset_before + change * t * t * t * (10.0 - t * (15.0 - 6.0 * t));
      const double slope = direction * change * 30.0 * t * t * (1.0 - t) * (1.0 - t) / lane_change_m;
      PlannedPose pose;
      pose.position = place.position + offset * Eigen::Vector2d(-std::sin(place.heading), std::cos(place.heading));
      pose.heading = place.heading + std::atan(slope);
      const std::size_t before = i == 0 ? 0 : i - 1;
      pose.speed = direction * (travelled[i] - travelled[before]) / plan_step_s;
      poses.push_back(pose);
    }
  }
  return poses;
}

}  // namespace

DriveCommand command_at(const std::vector<PlannedPose>& plan, double seconds) {
  if (plan.size() < 4) return {};
  // Motion's quintic spline is centred on the third of the six poses of an interval.
  const double knot = std::clamp(seconds / plan_step_s + 2.0, 1.0, static_cast<double>(plan.size()) - 3.0);
  const auto index = static_cast<std::size_t>(knot);
  const double share = knot - static_cast<double>(index);
  const auto command = [&](std::size_t i) {
    return DriveCommand{(plan[i + 1].speed - plan[i - 1].speed) / (2.0 * plan_step_s),
                        (plan[i + 1].heading - plan[i - 1].heading) / (2.0 * plan_step_s)};
  };
  const DriveCommand before = command(index), after = command(index + 1);
  return {before.acceleration_m_s2 + share * (after.acceleration_m_s2 - before.acceleration_m_s2),
          before.yaw_rate_rad_s + share * (after.yaw_rate_rad_s - before.yaw_rate_rad_s)};
}

std::vector<PlannedPose> plan_drive(const Sequence& sequence) {
  const Route route(sequence.waypoints, sequence.corner_radius_m);
  return plan(route, {{0.0, route.length(), 0.0, 0.0}}, sequence.speed, sequence.acceleration_m_s2,
              sequence.max_yaw_rate_rad_s, sequence.rest_s, sequence.rest_s);
}

std::vector<PlannedPose> plan_survey(const Sequence& sequence, const SurveyOptions& survey) {
  const auto& waypoints = sequence.survey_waypoints.empty() ? sequence.waypoints : sequence.survey_waypoints;
  const Route route(waypoints, sequence.corner_radius_m);
  std::vector<Leg> legs;
  for (const double offset : survey.lateral_offsets_m) {
    Leg leg{-survey.overrun_m, route.length() + survey.overrun_m, offset, offset};
    if (legs.size() % 2 == 1) std::swap(leg.begin, leg.end);
    if (!legs.empty()) leg.offset_before = legs.back().offset;
    legs.push_back(leg);
  }
  return plan(route, legs, {{0.0, survey.speed_m_s}}, sequence.acceleration_m_s2, sequence.max_yaw_rate_rad_s,
              sequence.rest_s, 2.0 * survey_rest_s);
}

}  // namespace lodestone::simulation
