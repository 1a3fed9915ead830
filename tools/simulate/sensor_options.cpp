#include "tools/simulate/sensor_options.h"

#include <cmath>

#include "core/angles.h"
#include "core/error.h"

namespace lodestone::simulation {
namespace {

void require(bool holds, const char* message) {
  if (!holds) throw InputError(message);
}

void require_vectors(const std::vector<double>& position, const std::vector<double>& rotation) {
  require(position.size() == 3, "position_m must be [x, y, z]");
  require(rotation.size() == 3, "rotation_rpy_deg must be [roll, pitch, yaw]");
}

}  // namespace

Pose mounting_pose(const std::vector<double>& position_m, const std::vector<double>& rotation_rpy_deg) {
  Pose pose;
  pose.position = {position_m[0], position_m[1], position_m[2]};
  pose.rotation = Eigen::AngleAxisd(rotation_rpy_deg[2] * degree, Vector3::UnitZ()) *
                  Eigen::AngleAxisd(rotation_rpy_deg[1] * degree, Vector3::UnitY()) *
                  Eigen::AngleAxisd(rotation_rpy_deg[0] * degree, Vector3::UnitX());
  return pose;
}

void LidarOptions::check() const {
  require(rows >= 1 && rows <= 1024 && columns >= 1 && columns <= 65536,
          "rows (1 to 1024) or columns (1 to 65536) is out of range");
  require(vertical_field_of_view_deg >= 0.0 && vertical_field_of_view_deg < 180.0,
          "vertical_field_of_view_deg must be at least 0 and below 180");
  require(rate_hz > 0.0 && rate_hz <= 1000.0, "rate_hz must be above 0, at most 1000");
  require(message == LidarMessage::pointcloud2 || rows <= 256, "rows must be at most 256 in a livox_custom message");
  if (pattern == LidarPattern::rosette) {
    const double firings = points_per_second / (4.0 * rate_hz);
    require(firings >= 1.0 && firings <= 1.0e6 && std::abs(firings - std::round(firings)) < 1e-6 * firings,
            "points_per_second must be a multiple of 4 rate_hz (four lines fire together)");
    require(lowest_elevation_deg >= -60.0 && highest_elevation_deg <= 80.0 &&
                highest_elevation_deg - lowest_elevation_deg >= 10.0,
            "lowest_elevation_deg must be at least -60 and highest_elevation_deg 10 more than that, at most 80");
  }
  require(first_scan_s >= 0.0, "first_scan_s must be at least 0");
  require(min_range_m >= 0.0 && max_range_m > min_range_m,
          "max_range_m must be more than min_range_m, both at least 0");
  require(range_noise_m >= 0.0, "range_noise_m must be at least 0");
  require(direction_noise_rad >= 0.0, "direction_noise_rad must be at least 0");
  require(max_incidence_deg > 0.0 && max_incidence_deg <= 90.0, "max_incidence_deg must be above 0, at most 90");
  require(dropout_probability >= 0.0 && dropout_probability < 1.0, "dropout_probability must be at least 0, below 1");
  require_vectors(position_m, rotation_rpy_deg);
}

void ImuOptions::check() const {
  require(rate_hz > 0.0 && rate_hz <= 1.0e5, "rate_hz must be above 0, at most 1e5");
  require(gyroscope_noise_density_rad_s_sqrt_hz >= 0.0 && accelerometer_noise_density_m_s2_sqrt_hz >= 0.0 &&
              gyroscope_bias_random_walk_rad_s2_sqrt_hz >= 0.0 && accelerometer_bias_random_walk_m_s3_sqrt_hz >= 0.0 &&
              gyroscope_bias_sigma_rad_s >= 0.0 && accelerometer_bias_sigma_m_s2 >= 0.0,
          "noise must be at least 0");
}

void MagnetometerMount::check() const {
  require_vectors(position_m, rotation_rpy_deg);
}

void MagnetometerOptions::check() const {
  require(rate_hz > 0.0 && rate_hz <= 1.0e5, "rate_hz must be above 0, at most 1e5");
  require(offset_s >= 0.0, "offset_s must be at least 0");
  require(noise_ut >= 0.0, "noise_ut must be at least 0");
}

void WheelOptions::check() const {
  require(rate_hz > 0.0 && rate_hz <= 1.0e4, "rate_hz must be above 0, at most 1e4");
  require(velocity_noise_m_s > 0.0, "velocity_noise_m_s must be above 0");
  require_vectors(position_m, rotation_rpy_deg);
}

void FloorOptions::check() const {
  require(slow_correlation_s > 0.0 && slow_correlation_s <= 60.0, "slow_correlation_s must be above 0, at most 60");
}

void SurveyOptions::check() const {
  require(!lateral_offsets_m.empty(), "lateral_offsets_m must name at least one lane");
  require(speed_m_s > 0.0, "speed_m_s must be above 0");
  require(overrun_m >= 0.0 && position_sigma_m >= 0.0 && angle_sigma_deg >= 0.0,
          "overrun_m, position_sigma_m and angle_sigma_deg must be at least 0");
}

void CloudOptions::check() const {
  require(point_spacing_m >= 0.005, "point_spacing_m must be at least 0.005");
  require(noise_m >= 0.0, "noise_m must be at least 0");
  require(viewpoint_spacing_m >= 0.1, "viewpoint_spacing_m must be at least 0.1");
}

}  // namespace lodestone::simulation
