#include "tools/simulate/lidar_simulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/simulate/random.h"

namespace lodestone::simulation {
namespace {

float cosine_of(double degrees) { return static_cast<float>(std::cos(degrees * std::numbers::pi / 180.0)); }

/// What a beam that met glass brings back in the end: a pane, what lies behind, or nothing. Each pane on its way lets it
/// pass with its transparency; the rest is mirrored, and comes back only where it meets the pane steeply enough.
RayHit follow_through_glass(const RayCaster& caster, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                            float max_range, RayHit hit, RandomStream& random) {
  while (hit.range >= 0.0F) {
    const Surface& surface = caster.surface(hit);
    if (surface.transparency <= 0.0 || random.uniform() >= surface.transparency)
      return hit.cosine >= cosine_of(surface.max_incidence_deg) ? hit : RayHit{};
    hit = caster.cast_beyond(origin, direction, hit.range, max_range);
  }
  return hit;
}

}  // namespace

LidarSimulator::LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options,
                               Time start_time, std::uint64_t seed)
    : caster_(caster),
      motion_(motion),
      options_(options),
      pattern_(options),
      T_imu_lidar_(options.T_imu_lidar()),
      start_time_(start_time),
      seed_(seed) {
  const double drive = motion.duration() - options.first_scan_s;
  scan_count_ = std::max(0, static_cast<int>(std::floor(drive * options.rate_hz)));
}

Time LidarSimulator::scan_end(int index) const {
  return start_time_ + from_seconds(pattern_.seconds(index, pattern_.firings() - 1));
}

LidarScan LidarSimulator::scan(int index) const {
  const int lines = pattern_.lines();
  LidarScan scan;
  scan.start = start_time_ + from_seconds(pattern_.seconds(index, 0));
  scan.end = scan_end(index);
  scan.points.reserve(static_cast<std::size_t>(lines) * pattern_.firings());
  RandomStream random(seed_, "lidar", static_cast<std::uint64_t>(index));
  RandomStream glass(seed_, "glass", static_cast<std::uint64_t>(index));  // a world without glass keeps its noise
  const float limit = cosine_of(options_.max_incidence_deg);
  const auto max_range = static_cast<float>(options_.max_range_m);
  std::vector<Vector3> beams(lines);
  std::vector<Eigen::Vector3f> directions(lines);
  std::vector<RayHit> hits(lines);
  for (int firing = 0; firing < pattern_.firings(); ++firing) {
    const double seconds = pattern_.seconds(index, firing);
    const Pose T_map_lidar = motion_.pose_at(seconds) * T_imu_lidar_;
    const Matrix3 R_map_lidar = T_map_lidar.rotation.toRotationMatrix();
    const Eigen::Vector3f origin = T_map_lidar.position.cast<float>();
    pattern_.directions(index, firing, beams);
    for (int line = 0; line < lines; ++line) directions[line] = (R_map_lidar * beams[line]).cast<float>();
    caster_.cast(origin, directions, max_range, hits);
    const auto offset = static_cast<std::int32_t>(start_time_ + from_seconds(seconds) - scan.start);
    for (int line = 0; line < lines; ++line) {
      const RayHit hit = caster_.has_glass()
                             ? follow_through_glass(caster_, origin, directions[line], max_range, hits[line], glass)
                             : hits[line];
      if (hit.range < 0.0F || hit.cosine < limit || random.uniform() < options_.dropout_probability) continue;
      const double range = hit.range + options_.range_noise_m * random.normal();
      if (range < options_.min_range_m || range > options_.max_range_m) continue;
      LidarPoint point;
      Vector3 told = beams[line];
      if (options_.direction_noise_rad > 0.0) {
        const double z = random.normal(), y = random.normal(), x = random.normal();  // drawn in one order by every compiler
        const Vector3 across(x, y, z);
        told = (told + options_.direction_noise_rad * (across - across.dot(told) * told)).normalized();
      }
      point.position = (range * told).cast<float>();
      point.intensity = std::round(100.0F * hit.cosine);
      point.offset_ns = offset;
      point.ring = static_cast<std::uint16_t>(line);
      scan.points.push_back(point);
    }
  }
  return scan;
}

}  // namespace lodestone::simulation
