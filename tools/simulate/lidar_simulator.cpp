#include "tools/simulate/lidar_simulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

float cosine_of(double degrees) {
  return static_cast<float>(std::cos(degrees * std::numbers::pi / 180.0));
}

/// Final return of a beam that met glass: a pane, an object behind, or nothing. Each pane transmits the beam with
/// probability `transparency`; a reflected beam returns only within max_incidence_deg of the normal.
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

// Mixed points. A beam is a few mrad wide; a receiver merges two echoes if their pulses, about 2 m long, overlap.
constexpr double beam_half_width_rad = 1.5e-3;  // one sigma, in each of the two directions across the beam
constexpr float least_step_m = 0.1F;
constexpr float longest_step_m = 2.0F;
constexpr double mixing_probability = 0.5;  // a beam on an edge may also return either surface

/// Whether two hits of neighbouring rays are on different sides of an edge: their ranges differ by more than a single
/// plane explains.
bool is_edge(const RayHit& hit, const RayHit& other, double angle) {
  const float step = std::abs(hit.range - other.range);
  const double cosine = std::clamp<double>(hit.cosine, 0.02, 1.0);
  const double along_plane = 2.0 * hit.range * angle * std::sqrt(1.0 - cosine * cosine) / cosine;
  return step > least_step_m + static_cast<float>(along_plane) && step < longest_step_m;
}

}  // namespace

struct LidarSimulator::Firing {
  double seconds;
  Eigen::Vector3f origin;
  std::span<const Eigen::Vector3f> directions;
  std::span<const Mover* const> movers;  ///< movers within reach during this scan
};

LidarSimulator::LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options,
                               Time start_time, std::uint64_t seed, LidarErrors errors, const Movers* movers)
    : caster_(caster),
      motion_(motion),
      errors_(std::move(errors)),
      movers_(movers),
      options_(options),
      pattern_(options),
      T_imu_lidar_(with_error(options.T_imu_lidar(), errors_.mounting)),
      start_time_(start_time),
      seed_(seed) {
  const double drive = motion.duration() - options.first_scan_s;
  scan_count_ = std::max(0, static_cast<int>(std::floor(drive * options.rate_hz)));
}

double LidarSimulator::stamp_error_s(int index) const {
  double jitter = 0.0;
  if (errors_.stamp_jitter_sigma_s > 0.0) {
    RandomStream random(seed_, "reality lidar jitter", static_cast<std::uint64_t>(index));
    const double most = std::min(3.0 * errors_.stamp_jitter_sigma_s, 0.4 / options_.rate_hz);
    jitter = std::clamp(errors_.stamp_jitter_sigma_s * random.normal(), -most, most);
  }
  return errors_.clock_offset_s + jitter;
}

Time LidarSimulator::scan_end(int index) const {
  return start_time_ + from_seconds(pattern_.seconds(index, pattern_.firings() - 1)) +
         from_seconds(stamp_error_s(index));
}

void LidarSimulator::cast(const Firing& firing, RandomStream& glass, std::span<RayHit> hits) const {
  const auto max_range = static_cast<float>(options_.max_range_m);
  caster_.cast(firing.origin, firing.directions, max_range, hits);
  for (std::size_t line = 0; line < hits.size(); ++line) {
    const Eigen::Vector3f& direction = firing.directions[line];
    if (caster_.has_glass()) {
      hits[line] = follow_through_glass(caster_, firing.origin, direction, max_range, hits[line], glass);
    }
    for (const Mover* mover : firing.movers) {
      const RayHit hit = meet(*mover, firing.seconds, firing.origin.cast<double>(), direction.cast<double>());
      if (hit.range < 0.0F || hit.range > max_range) continue;
      if (hits[line].range < 0.0F || hit.range < hits[line].range) hits[line] = hit;
    }
  }
}

void LidarSimulator::mix(const Firing& firing, RandomStream& random, RandomStream& glass,
                         std::span<RayHit> hits) const {
  std::vector<std::size_t> lines;
  std::vector<Eigen::Vector3f> others;
  std::vector<double> angles;
  const auto draw = [&] {
    // Uniform in a square: same sigma, cheaper than a normal distribution.
    return static_cast<float>(random.uniform(-1.0, 1.0) * std::numbers::sqrt3 * beam_half_width_rad);
  };
  for (std::size_t line = 0; line < hits.size(); ++line) {
    // Mixing is drawn before edges are searched: this saves half of the rays.
    if (random.uniform() >= mixing_probability) continue;
    const Eigen::Vector3f& beam = firing.directions[line];
    const Eigen::Vector3f aside = beam.unitOrthogonal(), up = beam.cross(aside);
    const float x = draw(), y = draw();
    lines.push_back(line);
    others.push_back((beam + x * aside + y * up).normalized());
    angles.push_back(std::sqrt(x * x + y * y));
  }
  std::vector<RayHit> other_hits(lines.size());
  cast({firing.seconds, firing.origin, others, firing.movers}, glass, other_hits);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    RayHit& hit = hits[lines[i]];
    const RayHit& other = other_hits[i];
    if (hit.range < 0.0F || other.range < 0.0F || !is_edge(hit, other, angles[i])) continue;
    hit.range += static_cast<float>(random.uniform()) * (other.range - hit.range);
  }
}

double LidarSimulator::range_bias(int line, const RayHit& hit) const {
  double bias = errors_.ring_bias_m.empty() ? 0.0 : errors_.ring_bias_m[static_cast<std::size_t>(line)];
  if (errors_.incidence_bias_m != 0.0) {
    static const double tangent_at_80 = std::tan(80.0 * std::numbers::pi / 180.0);
    static const double largest = std::tan(85.0 * std::numbers::pi / 180.0);
    const double cosine = std::max<double>(hit.cosine, 1e-3);
    const double tangent = std::min(largest, std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine);
    bias += errors_.incidence_bias_m * tangent / tangent_at_80;
  }
  return bias;
}

LidarScan LidarSimulator::scan(int index) const {
  const int lines = pattern_.lines();
  LidarScan scan;
  const Time true_start = start_time_ + from_seconds(pattern_.seconds(index, 0));
  scan.start = true_start + from_seconds(stamp_error_s(index));
  scan.end = scan_end(index);
  scan.points.reserve(static_cast<std::size_t>(lines) * pattern_.firings());
  RandomStream random(seed_, "lidar", static_cast<std::uint64_t>(index));
  RandomStream glass(seed_, "glass", static_cast<std::uint64_t>(index));  // glass must not change the noise
  RandomStream mixing(seed_, "reality mixed points", static_cast<std::uint64_t>(index));
  RandomStream mixing_glass(seed_, "reality mixed glass", static_cast<std::uint64_t>(index));
  const float limit = cosine_of(options_.max_incidence_deg);
  std::vector<const Mover*> movers;
  if (movers_ != nullptr) {
    constexpr double margin_m = 10.0;  // a mover's size, and the motion of mover and robot during a scan
    const double begin_s = pattern_.seconds(index, 0);
    movers = movers_->near(begin_s, pattern_.seconds(index, pattern_.firings() - 1), motion_.pose_at(begin_s).position,
                           options_.max_range_m + margin_m);
  }
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
    const Firing shot{seconds, origin, directions, movers};
    cast(shot, glass, hits);
    if (errors_.mixed_points) mix(shot, mixing, mixing_glass, hits);
    const auto offset = static_cast<std::int32_t>(start_time_ + from_seconds(seconds) - true_start);
    for (int line = 0; line < lines; ++line) {
      const RayHit hit = hits[line];
      if (hit.range < 0.0F || hit.cosine < limit || random.uniform() < options_.dropout_probability) continue;
      const double range = hit.range + range_bias(line, hit) + options_.range_noise_m * random.normal();
      if (range < options_.min_range_m || range > options_.max_range_m) continue;
      LidarPoint point;
      Vector3 told = beams[line];
      if (options_.direction_noise_rad > 0.0) {
        const double z = random.normal(), y = random.normal();
        const double x = random.normal();  // one by one: the order of evaluation is the same for every compiler
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
