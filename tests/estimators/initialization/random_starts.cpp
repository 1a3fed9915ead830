#include "tests/estimators/initialization/random_starts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

constexpr double path_m = 6.0;  // of a driving robot: more than it drives in five seconds
constexpr double path_check_m = 0.3;
constexpr double rest_s = 60.0;  // of a standing robot
constexpr int tries_a_start = 2000;
constexpr double under_way_s = 2.5;  // after this time, a driving robot has its speed

class FreeFloor {
 public:
  FreeFloor(const Environment& environment, const RandomStarts& options)
      : caster_(environment.caster), options_(options) {
    for (const Eigen::Vector3f& vertex : environment.scene.mesh.vertices) {
      low_ = low_.cwiseMin(vertex.head<2>().cast<double>());
      high_ = high_.cwiseMax(vertex.head<2>().cast<double>());
    }
  }

  Eigen::Vector2d draw(RandomStream& random) const {
    const double x = random.uniform(low_.x(), high_.x());
    return {x, random.uniform(low_.y(), high_.y())};
  }

  /// Floor at z = 0 below, and free space above (up to the head room) and around.
  bool holds(const Eigen::Vector2d& place) const {
    const Eigen::Vector3f middle(static_cast<float>(place.x()), static_cast<float>(place.y()), 0.1F);
    const float down = cast(middle, -Eigen::Vector3f::UnitZ(), 0.2F);
    if (!(down > 0.08F && down < 0.12F)) return false;
    if (cast(middle, Eigen::Vector3f::UnitZ(), static_cast<float>(options_.head_room_m)) >= 0.0F) return false;
    for (const float height : {0.1F, 0.35F, 0.6F}) {
      const Eigen::Vector3f origin(middle.x(), middle.y(), height);
      for (int i = 0; i < 24; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / 24.0;
        const Eigen::Vector3f direction(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.0F);
        if (cast(origin, direction, static_cast<float>(options_.robot_radius_m)) >= 0.0F) return false;
      }
    }
    return true;
  }

  bool holds_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / path_check_m)));
    for (int i = 0; i <= steps; ++i) {
      if (!holds(a + (b - a) * (static_cast<double>(i) / steps))) return false;
    }
    return true;
  }

 private:
  float cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float range) const {
    RayHit hit;
    caster_.cast(origin, {&direction, 1}, range, {&hit, 1});
    return hit.range;
  }

  const RayCaster& caster_;
  const RandomStarts& options_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-1e9);
};

Eigen::Vector2d towards(double heading) {
  return {std::cos(heading), std::sin(heading)};
}

}  // namespace

std::vector<RandomStart> random_starts(const Environment& environment, const RandomStarts& options) {
  const FreeFloor floor(environment, options);
  std::vector<RandomStart> starts;
  for (int index = 0; index < options.count; ++index) {
    RandomStream random(options.seed, "random start", static_cast<std::uint64_t>(index));
    const bool moves = random.uniform() < options.moving_share;
    for (int attempt = 0; attempt < tries_a_start; ++attempt) {
      const Eigen::Vector2d place = floor.draw(random);
      const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
      const double bend = random.uniform(-0.5, 0.5);
      if (!floor.holds(place)) continue;
      const Eigen::Vector2d middle = place + 0.5 * path_m * towards(heading);
      const Eigen::Vector2d end = middle + 0.5 * path_m * towards(heading + bend);
      if (moves && !(floor.holds_between(place, middle) && floor.holds_between(middle, end))) continue;
      RandomStart start;
      start.sequence.waypoints = {place, middle, end};
      start.sequence.speed = {{0.0, options.speed_m_s}};
      start.sequence.rest_s = moves ? 0.0 : rest_s;
      start.skip_s = moves ? under_way_s : 0.0;
      starts.push_back(start);
      break;
    }
  }
  return starts;
}

World with_sequence(World world, const std::string& name, const Sequence& sequence) {
  world.sequences[name] = sequence;
  return world;
}

}  // namespace lodestone::simulation
