#include "estimators/smoother/field_weighting.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/maps/field_residual.h"
#include "core/observability/robust_weight.h"

namespace lodestone {

std::vector<double> array_crowding(const SensorSuite& suite, double correlation_m) {
  std::vector<double> result;
  for (const MagnetometerModel& own : suite.magnetometers) {
    double sum = 0.0;
    for (const MagnetometerModel& other : suite.magnetometers) {
      const double distance_m = (own.T_imu_mag.position - other.T_imu_mag.position).norm();
      sum += correlation_m > 0.0 ? std::exp(-distance_m / correlation_m) : (&own == &other ? 1.0 : 0.0);
    }
    result.push_back(sum);
  }
  return result;
}

std::vector<FieldReading> weigh_field(std::span<const ArrayReading> arrays, const Pose& T_map_imu,
                                      const Matrix6& covariance, double spacing_m, double factor,
                                      const FieldWeighting& weighting, FieldStatistics& statistics) {
  const MagneticOptions& options = weighting.options;
  const double inflation = correlation_inflation(spacing_m, options.map_correlation_m, options.map_max_inflation);
  std::vector<FieldReading> result;
  for (const ArrayReading& array : arrays) {
    const Eigen::Index most = 3 * static_cast<Eigen::Index>(array.readings.size());
    Eigen::VectorXd residual(most);
    Eigen::MatrixXd jacobian(most, 6);
    Eigen::VectorXd variance(most);
    Eigen::Index rows = 0;
    const std::size_t first = result.size();
    for (const MeanReading& reading : array.readings) {
      const auto field = weighting.map.query(T_map_imu * reading.T_end_mag.position, options.interpolation);
      if (!field) {
        ++statistics.off_map;
        continue;
      }
      const FieldResidual part = field_residual(
          T_map_imu, reading.T_end_mag, reading.measured_ut - weighting.bias_ut(reading.magnetometer), *field);
      const double noise = weighting.suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
      const double sensor_variance = noise * noise / reading.samples;
      const double crowding = weighting.crowding[static_cast<std::size_t>(reading.magnetometer)];
      const double map_sigma = options.map_sigma ? std::max(field->sigma_ut, options.map_sigma_floor_ut) : 0.0;
      residual.segment<3>(rows) = part.residual_ut;
      jacobian.middleRows<3>(rows) = part.jacobian;
      variance.segment<3>(rows).setConstant(sensor_variance + map_sigma * map_sigma);
      rows += 3;
      result.push_back({reading.T_end_mag, reading.measured_ut, reading.magnetometer,
                        std::sqrt(sensor_variance + inflation * crowding * map_sigma * map_sigma), factor});
    }
    if (rows == 0) continue;
    ++statistics.arrays;
    statistics.residual_squared_sum += residual.head(rows).squaredNorm();
    statistics.components += static_cast<int>(rows);
    double weight = 1.0;
    if (options.huber) {
      Eigen::MatrixXd innovation = jacobian.topRows(rows) * covariance * jacobian.topRows(rows).transpose();
      innovation.diagonal() += variance.head(rows);
      const double distance = std::sqrt(residual.head(rows).dot(innovation.llt().solve(residual.head(rows))));
      weight = huber_weight(distance, mahalanobis_quantile(static_cast<int>(rows), options.huber_probability));
    }
    statistics.weight_sum += weight;
    if (weight < 0.5) ++statistics.rejected;
    for (std::size_t i = first; i < result.size(); ++i) result[i].weight *= weight;
  }
  return result;
}

}  // namespace lodestone
