#include "tools/simulate/cloud_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/random_stream.h"
#include "tools/simulate/displacement_field.h"
#include "tools/simulate/reality.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {
namespace {

constexpr std::size_t chunk = 256;   // triangles that share one random stream
constexpr std::int64_t probes = 12;  // a triangle is skipped if the scanner sees none of this many points

/// Viewpoints along all sequences' paths, at the heights of the LiDAR and of the scanner, at least one spacing apart.
std::vector<Eigen::Vector3f> find_viewpoints(const World& world) {
  const double spacing = world.cloud.viewpoint_spacing_m;
  const double lidar_height = world.imu.height_m + world.lidar.T_imu_lidar().position.z();
  std::vector<Eigen::Vector2d> places;
  for (const auto& [name, sequence] : world.sequences) {
    const Route route(sequence.waypoints, sequence.corner_radius_m);
    for (double distance = 0.0; distance <= route.length(); distance += spacing) {
      const Eigen::Vector2d place = route.at(distance).position;
      const auto is_near = [&](const Eigen::Vector2d& other) { return (other - place).norm() < 0.5 * spacing; };
      if (std::none_of(places.begin(), places.end(), is_near)) places.push_back(place);
    }
  }
  std::vector<Eigen::Vector3f> viewpoints;
  for (const Eigen::Vector2d& place : places)
    for (const double height : {lidar_height, world.cloud.viewpoint_height_m})
      viewpoints.push_back(Vector3(place.x(), place.y(), height).cast<float>());
  return viewpoints;
}

/// A point on a surface that may be surveyed.
struct Target {
  Eigen::Vector3f point;
  Eigen::Vector3f normal;
  const Surface& surface;
};

/// Largest share of a scanner's beams towards `target` that return, over all viewpoints in range. Glass transmits most
/// beams, reflects oblique beams away, and dims surfaces behind it. `hint`: the viewpoint of the previous answer;
/// neighbouring points mostly share it.
double returned_share(const RayCaster& caster, const std::vector<Eigen::Vector3f>& viewpoints, const Target& target,
                      float range, std::size_t& hint) {
  const double best_possible = 1.0 - target.surface.transparency;
  const double limit = std::cos(target.surface.max_incidence_deg * std::numbers::pi / 180.0);
  const auto share_from = [&](std::size_t index) {
    const Eigen::Vector3f beam = target.point - viewpoints[index];
    if (!(beam.squaredNorm() < range * range)) return 0.0;
    if (limit > 1e-6 && std::abs(beam.normalized().dot(target.normal)) < limit) return 0.0;
    return best_possible * caster.transmission(viewpoints[index], target.point);
  };
  double best = hint < viewpoints.size() ? share_from(hint) : 0.0;
  for (std::size_t index = 0; index < viewpoints.size() && best < best_possible; ++index) {
    const double share = share_from(index);
    if (share <= best) continue;
    best = share;
    hint = index;
  }
  return best;
}

/// Errors of the surveyed map: it is displaced, and some surfaces appear twice, because the scanner passed a second
/// time with another error. These surfaces are drawn for cubes of a few metres and three directions of the normal.
class SurveyErrors {
 public:
  SurveyErrors(const World& world, std::uint64_t seed)
      : options_(world.reality),
        seed_(seed),
        noise_m_(options_.cloud_noise_m > 0.0 ? options_.cloud_noise_m : world.cloud.noise_m),
        displacement_(draw_reality(world, seed).displacement) {}

  Vector3 draw_noise(RandomStream& random) const { return noise_m_ * random.normal3(); }

  /// Appends a point of a surface with unit `normal`, with noise, and its copy on the second surface if there is one.
  void map(const Vector3& point, const Vector3& noise, const Vector3& normal, RandomStream& second_random,
           std::vector<Eigen::Vector3f>& points) const {
    append(point, noise, points);
    if (!(options_.doubled_walls_share > 0.0)) return;
    const double offset = second_offset(point, normal);
    if (offset != 0.0) append(point + offset * normal, draw_noise(second_random), points);
  }

 private:
  static constexpr double cube_m = 4.0;

  void append(const Vector3& point, const Vector3& noise, std::vector<Eigen::Vector3f>& points) const {
    Vector3 mapped = point + noise;
    if (!displacement_.empty()) mapped += displacement_.at(point);
    points.push_back(mapped.cast<float>());
  }

  /// Offset of the second copy of a surface along its normal, m; 0: no copy.
  double second_offset(const Vector3& point, const Vector3& normal) const {
    int facing = 0;
    normal.cwiseAbs().maxCoeff(&facing);
    // A plane on the border between two cubes is assigned to one cube.
    const Vector3 inside = point + 1e-3 * Vector3::Ones();
    auto key = static_cast<std::uint64_t>(facing);
    for (int axis = 0; axis < 3; ++axis) {
      const auto cell = static_cast<std::int64_t>(std::floor(inside[axis] / cube_m));
      key = mix(key + static_cast<std::uint64_t>(cell) + 0x9e3779b97f4a7c15ULL);
    }
    RandomStream random(seed_, "reality doubled walls", key);
    if (random.uniform() >= options_.doubled_walls_share) return 0.0;
    const double side = random.uniform() < 0.5 ? -1.0 : 1.0;
    // The two triangles of a face have the copy on the same side, whatever the sign of their normals.
    return normal[facing] < 0.0 ? -side * options_.doubled_walls_distance_m : side * options_.doubled_walls_distance_m;
  }

  RealityOptions options_;
  std::uint64_t seed_;
  double noise_m_;
  DisplacementField displacement_;
};

}  // namespace

std::vector<Eigen::Vector3f> sample_cloud(const World& world, const Environment& environment, std::uint64_t seed) {
  const TriangleMesh& mesh = environment.scene.mesh;
  const std::vector<Eigen::Vector3f> viewpoints = find_viewpoints(world);
  const SurveyErrors errors(world, seed);
  const double density = 1.0 / (world.cloud.point_spacing_m * world.cloud.point_spacing_m);
  const auto range = static_cast<float>(world.cloud.viewpoint_range_m);
  const std::size_t chunks = (mesh.triangles.size() + chunk - 1) / chunk;
  std::vector<std::vector<Eigen::Vector3f>> parts(chunks);
  parallel_for(std::size_t{0}, chunks, [&](std::size_t part) {
    RandomStream random(seed, "cloud", part), second_random(seed, "reality second copy", part);
    std::size_t hint = 0;
    for (std::size_t t = part * chunk; t < std::min((part + 1) * chunk, mesh.triangles.size()); ++t) {
      const auto& triangle = mesh.triangles[t];
      const Vector3 a = mesh.vertices[triangle[0]].cast<double>();
      const Vector3 u = mesh.vertices[triangle[1]].cast<double>() - a;
      const Vector3 v = mesh.vertices[triangle[2]].cast<double>() - a;
      const Vector3 normal = u.cross(v);
      const Eigen::Vector3f unit_normal = normal.normalized().cast<float>();
      const Surface& surface = mesh.surface_of(t);
      const double expected = 0.5 * normal.norm() * density;
      const auto count = static_cast<std::int64_t>(std::floor(expected + random.uniform()));
      bool any_seen = surface != Surface{};  // glass is visible from few viewpoints: every point is tested
      for (std::int64_t i = 0; i < count && (any_seen || i < probes); ++i) {
        double first = random.uniform(), second = random.uniform();
        if (first + second > 1.0) first = 1.0 - first, second = 1.0 - second;
        const Vector3 point = a + first * u + second * v;
        const Vector3 noise = errors.draw_noise(random);
        const Target target{point.cast<float>(), unit_normal, surface};
        const double share = returned_share(environment.caster, viewpoints, target, range, hint);
        if (share <= 0.0) continue;
        any_seen = true;
        if (share < 1.0 && random.uniform() >= share) continue;
        errors.map(point, noise, normal.normalized(), second_random, parts[part]);
      }
    }
  });
  std::vector<Eigen::Vector3f> points;
  for (const auto& part : parts) points.insert(points.end(), part.begin(), part.end());
  return points;
}

}  // namespace lodestone::simulation
