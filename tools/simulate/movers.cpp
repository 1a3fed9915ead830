#include "tools/simulate/movers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/random_stream.h"
#include "tools/simulate/magnetic_field.h"

namespace lodestone::simulation {
namespace {

constexpr double person_radius_m = 0.25;
constexpr double person_height_m = 1.75;
constexpr double person_speed_m_s = 1.2;
const Vector3 vehicle_size(2.5, 1.2, 2.0);     // m: a forklift or a tug, x forward
constexpr double vehicle_moment_sigma = 60.0;  // A·m², a component of each of four dipoles: about two tonnes of steel
constexpr double encounter_s = 20.0;           // duration of an encounter
constexpr double longest_way_m = 25.0;
constexpr double shortest_way_m = 3.0;
constexpr double robot_radius_m = 0.45;
constexpr double least_gap_m = 0.1;  // between the robot and a passing mover
constexpr double farthest_field_m = 25.0;
constexpr int mover_tries = 40;

double half_width(bool is_vehicle) {
  return is_vehicle ? 0.5 * vehicle_size.y() : person_radius_m;
}
double half_length(bool is_vehicle) {
  return is_vehicle ? 0.5 * vehicle_size.x() : person_radius_m;
}

/// Free distance from `place` along `direction` on the floor for the whole body, at most `most`.
double free_way(const RayCaster& caster, const Eigen::Vector2d& place, const Eigen::Vector2d& direction,
                bool is_vehicle, double most) {
  const Eigen::Vector2d left(-direction.y(), direction.x());
  const Eigen::Vector3f ahead(static_cast<float>(direction.x()), static_cast<float>(direction.y()), 0.0F);
  double way = most + half_length(is_vehicle);
  for (const double side : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const Eigen::Vector2d foot = place + side * (half_width(is_vehicle) + 0.05) * left;
    for (const float height : {0.15F, 0.5F, 1.0F, 1.6F}) {
      RayHit hit;
      const Eigen::Vector3f origin(static_cast<float>(foot.x()), static_cast<float>(foot.y()), height);
      caster.cast(origin, {&ahead, 1}, static_cast<float>(way), {&hit, 1});
      if (hit.range >= 0.0F) way = std::min(way, static_cast<double>(hit.range));
    }
  }
  return way - half_length(is_vehicle) - 0.1;
}

bool stands_on_floor(const RayCaster& caster, const Eigen::Vector2d& place) {
  RayHit hit;
  const Eigen::Vector3f down = -Eigen::Vector3f::UnitZ();
  caster.cast({static_cast<float>(place.x()), static_cast<float>(place.y()), 0.1F}, {&down, 1}, 0.2F, {&hit, 1});
  return hit.range > 0.08F && hit.range < 0.12F;
}

/// Distance between the robot's edge and the mover's.
double gap_to_robot(const Mover& mover, double seconds, const Motion& motion) {
  const Eigen::Vector2d offset = motion.pose_at(seconds).position.head<2>() - mover.place(seconds);
  const Eigen::Vector2d forward = (mover.to - mover.from).normalized();
  const double along = std::abs(offset.dot(forward)),
               across = std::abs(forward.x() * offset.y() - forward.y() * offset.x());
  if (!mover.is_vehicle) return offset.norm() - person_radius_m - robot_radius_m;
  const double beyond = std::max(0.0, along - 0.5 * vehicle_size.x()),
               beside = std::max(0.0, across - 0.5 * vehicle_size.y());
  return std::hypot(beyond, beside) - robot_radius_m;
}

bool keeps_off_robot(const Mover& mover, const Motion& motion) {
  const double last = std::min(mover.end_s, motion.duration());
  for (double seconds = std::max(0.0, mover.begin_s); seconds <= last; seconds += 0.05)
    if (gap_to_robot(mover, seconds, motion) < least_gap_m) return false;
  return true;
}

std::vector<FieldSource> draw_steel(RandomStream& random) {
  std::vector<FieldSource> steel(4);
  for (FieldSource& source : steel) {
    for (int axis = 0; axis < 2; ++axis) source.position[axis] = vehicle_size[axis] * random.uniform(-0.4, 0.4);
    source.position.z() = random.uniform(0.2, 1.2);
    source.moment = vehicle_moment_sigma * random.normal3();
  }
  return steel;
}

/// A mover whose meeting time is in [first_s, last_s); nothing if there is no room.
std::optional<Mover> draw_mover(bool is_vehicle, double first_s, double last_s, const RayCaster& caster,
                                const Motion& motion, RandomStream& random) {
  for (int attempt = 0; attempt < mover_tries; ++attempt) {
    Mover mover;
    mover.is_vehicle = is_vehicle;
    mover.meeting_s = random.uniform(first_s, last_s);
    const Pose robot = motion.pose_at(mover.meeting_s);
    const double bearing = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double distance = random.uniform(half_width(is_vehicle) + robot_radius_m + least_gap_m, 6.0);
    // Two thirds move parallel to the robot's path, as in aisles; a third crosses it.
    const Vector3 robot_forward = robot.rotation * Vector3::UnitX();
    const double heading = std::atan2(robot_forward.y(), robot_forward.x()) +
                           (random.uniform() < 0.5 ? std::numbers::pi : 0.0) +
                           (random.uniform() < 1.0 / 3.0 ? random.uniform(-1.5, 1.5) : random.uniform(-0.05, 0.05));
    const Eigen::Vector2d forward(std::cos(heading), std::sin(heading));
    const Eigen::Vector2d place =
        robot.position.head<2>() + distance * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    mover.speed_m_s = is_vehicle ? random.uniform(1.5, 3.0) : person_speed_m_s;
    const Eigen::Vector3f eye = robot.position.cast<float>() + 0.3F * Eigen::Vector3f::UnitZ();
    if (!caster.sees(eye, {static_cast<float>(place.x()), static_cast<float>(place.y()), 1.0F})) continue;
    const double ahead = free_way(caster, place, forward, is_vehicle, 0.5 * longest_way_m);
    const double back = free_way(caster, place, -forward, is_vehicle, 0.5 * longest_way_m);
    if (ahead < 0.1 || back < 0.1 || ahead + back < shortest_way_m) continue;
    mover.from = place - back * forward;
    mover.to = place + ahead * forward;
    mover.meeting_m = back;
    mover.begin_s = mover.meeting_s - 0.5 * encounter_s;
    mover.end_s = mover.meeting_s + 0.5 * encounter_s;
    if (!stands_on_floor(caster, mover.from) || !stands_on_floor(caster, place) || !stands_on_floor(caster, mover.to))
      continue;
    if (!keeps_off_robot(mover, motion)) continue;
    if (is_vehicle) mover.steel = draw_steel(random);
    return mover;
  }
  return std::nullopt;
}

/// The part of a ray between two parallel planes at ±half; empty if `enter` > `leave`.
struct Span {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  double cosine = 0.0;  ///< at `enter`

  void cut(double from, double to, double cosine_there) {
    if (from > enter) {
      enter = from;
      cosine = cosine_there;
    }
    leave = std::min(leave, to);
  }
  void cut_slab(double origin, double direction, double low, double high) {
    if (std::abs(direction) < 1e-12) {
      if (origin < low || origin > high) leave = -std::numeric_limits<double>::infinity();
      return;
    }
    const double first = (low - origin) / direction, second = (high - origin) / direction;
    cut(std::min(first, second), std::max(first, second), std::abs(direction));
  }
};

}  // namespace

Eigen::Vector2d Mover::place(double seconds) const {
  const Eigen::Vector2d way = to - from;
  const double length = way.norm();
  const double travelled = meeting_m + speed_m_s * (seconds - meeting_s);
  const double turn = travelled - 2.0 * length * std::floor(travelled / (2.0 * length));
  return from + way * ((turn <= length ? turn : 2.0 * length - turn) / length);
}

Movers::Movers(double people, double vehicles, const RayCaster& caster, const Motion& motion, std::uint64_t seed) {
  // One meeting per interval: the beginning of a drive does not depend on its length.
  const auto draw = [&](bool is_vehicle, double at_once) {
    if (!(at_once > 0.0)) return;
    const double interval_s = encounter_s / at_once;
    for (std::uint64_t i = 0; static_cast<double>(i) * interval_s < motion.duration(); ++i) {
      const double first_s = static_cast<double>(i) * interval_s;
      RandomStream random(seed, is_vehicle ? "reality vehicle" : "reality person", i);
      auto mover = draw_mover(is_vehicle, first_s, first_s + interval_s, caster, motion, random);
      if (mover) movers_.push_back(std::move(*mover));
    }
  };
  draw(false, people);
  draw(true, vehicles);
}

std::vector<const Mover*> Movers::near(double begin_s, double end_s, const Vector3& place, double reach_m) const {
  std::vector<const Mover*> found;
  for (const Mover& mover : movers_) {
    if (mover.end_s < begin_s || mover.begin_s > end_s) continue;
    if ((mover.place(begin_s) - place.head<2>()).norm() < reach_m) found.push_back(&mover);
  }
  return found;
}

Vector3 Movers::field_ut(double seconds, const Vector3& point) const {
  Vector3 field = Vector3::Zero();
  for (const Mover& mover : movers_) {
    if (mover.steel.empty() || seconds < mover.begin_s || seconds > mover.end_s) continue;
    const Eigen::Vector2d place = mover.place(seconds);
    if ((place - point.head<2>()).norm() > farthest_field_m) continue;
    const Eigen::Vector2d way = mover.to - mover.from;
    const Quaternion turn(Eigen::AngleAxisd(std::atan2(way.y(), way.x()), Vector3::UnitZ()));
    for (FieldSource source : mover.steel) {
      source.position = turn * source.position + Vector3(place.x(), place.y(), 0.0);
      source.moment = turn * source.moment;
      field += source_field_ut(source, point);
    }
  }
  return field;
}

RayHit meet(const Mover& mover, double seconds, const Vector3& origin, const Vector3& direction) {
  if (seconds < mover.begin_s || seconds > mover.end_s) return {};
  const Eigen::Vector2d place = mover.place(seconds);
  const Eigen::Vector2d offset = origin.head<2>() - place;
  Span span;
  if (mover.is_vehicle) {
    const Eigen::Vector2d forward = (mover.to - mover.from).normalized(), left(-forward.y(), forward.x());
    span.cut_slab(offset.dot(forward), direction.head<2>().dot(forward), -0.5 * vehicle_size.x(),
                  0.5 * vehicle_size.x());
    span.cut_slab(offset.dot(left), direction.head<2>().dot(left), -0.5 * vehicle_size.y(), 0.5 * vehicle_size.y());
    span.cut_slab(origin.z(), direction.z(), 0.0, vehicle_size.z());
  } else {
    const double a = direction.head<2>().squaredNorm(), b = offset.dot(direction.head<2>());
    const double discriminant = b * b - a * (offset.squaredNorm() - person_radius_m * person_radius_m);
    if (discriminant <= 0.0 || a < 1e-12) return {};
    const double root = std::sqrt(discriminant);
    span.cut((-b - root) / a, (-b + root) / a, root / person_radius_m);
    span.cut_slab(origin.z(), direction.z(), 0.0, person_height_m);
  }
  if (!(span.enter > 0.0 && span.enter < span.leave)) return {};
  RayHit hit;
  hit.range = static_cast<float>(span.enter);
  hit.cosine = static_cast<float>(std::min(1.0, span.cosine));
  return hit;
}

}  // namespace lodestone::simulation
