#include "frontends/simulation/lidar_simulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "frontends/simulation/random.h"

namespace lodestone::simulation {

LidarSimulator::LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options,
                               Time start_time, std::uint64_t seed)
    : caster_(caster),
      motion_(motion),
      options_(options),
      T_imu_lidar_(options.T_imu_lidar()),
      start_time_(start_time),
      seed_(seed) {
  const double drive = motion.duration() - options.first_scan_s;
  scan_count_ = std::max(0, static_cast<int>(std::floor(drive * options.rate_hz)));
  const double field_of_view = options.vertical_field_of_view_deg * std::numbers::pi / 180.0;
  for (int row = 0; row < options.rows; ++row) {
    const double share = options.rows > 1 ? static_cast<double>(row) / (options.rows - 1) : 0.5;
    const double elevation = field_of_view * (0.5 - share);
    row_directions_.emplace_back(std::cos(elevation), 0.0, std::sin(elevation));
  }
}

double LidarSimulator::column_seconds(int index, int column) const {
  return options_.first_scan_s + (index + static_cast<double>(column) / options_.columns) / options_.rate_hz;
}

Time LidarSimulator::scan_end(int index) const {
  return start_time_ + from_seconds(column_seconds(index, options_.columns - 1));
}

LidarScan LidarSimulator::scan(int index) const {
  LidarScan scan;
  scan.start = start_time_ + from_seconds(column_seconds(index, 0));
  scan.end = scan_end(index);
  scan.points.reserve(static_cast<std::size_t>(options_.rows) * options_.columns);
  RandomStream random(seed_, "lidar", static_cast<std::uint64_t>(index));
  const auto limit = static_cast<float>(std::cos(options_.max_incidence_deg * std::numbers::pi / 180.0));
  std::vector<Eigen::Vector3f> directions(options_.rows);
  std::vector<RayHit> hits(options_.rows);
  for (int column = 0; column < options_.columns; ++column) {
    const double seconds = column_seconds(index, column);
    const Pose T_map_lidar = motion_.pose_at(seconds) * T_imu_lidar_;
    // Behind is azimuth 180°; from there the head turns clockwise seen from above.
    const double azimuth = std::numbers::pi - 2.0 * std::numbers::pi * column / options_.columns;
    const double cosine = std::cos(azimuth), sine = std::sin(azimuth);
    const Matrix3 R_map_lidar = T_map_lidar.rotation.toRotationMatrix();
    const auto beam = [&](int row) {
      const Vector3& d = row_directions_[row];
      return Vector3(d.x() * cosine, d.x() * sine, d.z());
    };
    for (int row = 0; row < options_.rows; ++row) directions[row] = (R_map_lidar * beam(row)).cast<float>();
    caster_.cast(T_map_lidar.position.cast<float>(), directions, static_cast<float>(options_.max_range_m), hits);
    const auto offset = static_cast<std::int32_t>(start_time_ + from_seconds(seconds) - scan.start);
    for (int row = 0; row < options_.rows; ++row) {
      const RayHit& hit = hits[row];
      if (hit.range < 0.0F || hit.cosine < limit || random.uniform() < options_.dropout_probability) continue;
      const double range = hit.range + options_.range_noise_m * random.normal();
      if (range < options_.min_range_m || range > options_.max_range_m) continue;
      LidarPoint point;
      point.position = (range * beam(row)).cast<float>();
      point.intensity = std::round(100.0F * hit.cosine);
      point.offset_ns = offset;
      point.ring = static_cast<std::uint16_t>(row);
      scan.points.push_back(point);
    }
  }
  return scan;
}

}  // namespace lodestone::simulation
