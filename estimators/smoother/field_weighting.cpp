#include "estimators/smoother/field_weighting.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/robust_weight.h"

namespace lodestone {

FieldResidual calibrated_residual(const Pose& T_map_imu, const Pose& T_end_mag, const Vector3& measured_ut,
                                  const Vector3& bias_ut, const Matrix3& matrix, const FieldValue& map) {
  const Vector3 unbiased_ut = measured_ut - bias_ut;
  FieldResidual result = field_residual(T_map_imu, T_end_mag, unbiased_ut, map);
  result.residual_ut -= matrix * (unbiased_ut - result.residual_ut);
  return result;
}

double map_correlation_m(const MagneticOptions& options, const MagneticMap& map) {
  constexpr double usual_m = 0.1;
  if (options.map_correlation_m >= 0.0) return options.map_correlation_m;
  return map.errors().correlation_m > 0.0 ? map.errors().correlation_m : usual_m;
}

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

namespace {

/// Mutual consistency of an array's readings. From the innovations of all, with S = J P Jᵀ + R and u = S⁻¹ r, the
/// residual of magnetometer j given the others is S⁻¹_jj⁻¹ u_j, with the covariance S⁻¹_jj⁻¹.
class ArrayJudgement {
 public:
  ArrayJudgement(const Eigen::VectorXd& residual, const Eigen::MatrixXd& innovation)
      : residual_(residual), innovation_(innovation) {
    for (Eigen::Index i = 0; i < residual.size() / 3; ++i) kept_.push_back(i);
  }

  /// Rejects the magnetometer that deviates most from its prediction by the others, one at a time, while its distance
  /// is beyond `gate` and more than half of the array remains. Returns the rejected ones.
  std::vector<Eigen::Index> set_aside(double gate) {
    std::vector<Eigen::Index> result;
    const std::size_t least = kept_.size() / 2 + 1;
    while (kept_.size() > least && kept_.size() > 2) {
      const Eigen::MatrixXd inverse = kept_innovation().inverse();
      const Eigen::VectorXd scaled = inverse * kept_residual();
      double worst = gate;
      std::size_t which = kept_.size();
      for (std::size_t i = 0; i < kept_.size(); ++i) {
        const auto row = 3 * static_cast<Eigen::Index>(i);
        const Vector3 u = scaled.segment<3>(row);
        const Matrix3 own = inverse.block<3, 3>(row, row);
        const double distance = std::sqrt(std::max(0.0, u.dot(own.inverse() * u)));
        if (distance > worst) {
          worst = distance;
          which = i;
        }
      }
      if (which == kept_.size()) break;
      result.push_back(kept_[which]);
      kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(which));
    }
    return result;
  }

  /// s = √(rᵀ S⁻¹ r) of the remaining magnetometers.
  double distance() const {
    const Eigen::VectorXd residual = kept_residual();
    return std::sqrt(residual.dot(kept_innovation().llt().solve(residual)));
  }

  int kept() const { return static_cast<int>(kept_.size()); }

 private:
  Eigen::VectorXd kept_residual() const {
    Eigen::VectorXd result(3 * kept());
    for (int i = 0; i < kept(); ++i)
      result.segment<3>(3 * i) = residual_.segment<3>(3 * kept_[static_cast<std::size_t>(i)]);
    return result;
  }
  Eigen::MatrixXd kept_innovation() const {
    Eigen::MatrixXd result(3 * kept(), 3 * kept());
    for (int i = 0; i < kept(); ++i) {
      for (int j = 0; j < kept(); ++j) {
        result.block<3, 3>(3 * i, 3 * j) =
            innovation_.block<3, 3>(3 * kept_[static_cast<std::size_t>(i)], 3 * kept_[static_cast<std::size_t>(j)]);
      }
    }
    return result;
  }

  const Eigen::VectorXd& residual_;
  const Eigen::MatrixXd& innovation_;
  std::vector<Eigen::Index> kept_;
};

}  // namespace

std::vector<FieldReading> weigh_field(std::span<const ArrayReading> arrays, const Pose& T_map_imu,
                                      const Matrix6& covariance, double spacing_m, double factor,
                                      const FieldWeighting& weighting, FieldStatistics& statistics) {
  const MagneticOptions& options = weighting.options;
  const double inflation = correlation_inflation(spacing_m, map_correlation_m(options, weighting.map));
  std::vector<FieldReading> result;
  for (const ArrayReading& array : arrays) {
    const Eigen::Index most = 3 * static_cast<Eigen::Index>(array.readings.size());
    Eigen::VectorXd residual(most);
    Eigen::MatrixXd jacobian(most, 6);
    Eigen::VectorXd variance(most);
    Eigen::VectorXd by_clock(most);
    Eigen::Index rows = 0;
    const std::size_t first = result.size();
    for (const MeanReading& reading : array.readings) {
      FieldReading taken{reading.T_end_mag,    reading.measured_ut, reading.magnetometer, 1.0, factor,
                         reading.velocity_m_s, reading.turn_rad_s};
      const Pose T_end_mag = taken.T_end_mag_at(weighting.clock.offset_s);
      taken.place = T_map_imu * T_end_mag.position;
      const auto field = weighting.map.query(taken.place, options.interpolation);
      taken.field = field;
      if (!field) {
        ++statistics.off_map;
        continue;
      }
      const FieldResidual part =
          calibrated_residual(T_map_imu, T_end_mag, reading.measured_ut, weighting.bias_ut(reading.magnetometer),
                              weighting.matrix(reading.magnetometer), *field);
      const double noise = weighting.suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
      const double sensor_variance = noise * noise / reading.samples;
      const double crowding = weighting.crowding[static_cast<std::size_t>(reading.magnetometer)];
      // An error of the magnetometer's mounting position, times the gradient, is an error of the field, like the map's.
      const double by_place = weighting.suite.calibration.magnetometers.translation_sigma_m *
                              part.jacobian.rightCols<3>().norm() / std::sqrt(3.0);
      const double map_sigma =
          options.map_sigma ? std::hypot(std::max(field->sigma_ut, kMapSigmaFloor_ut), by_place) : 0.0;
      residual.segment<3>(rows) = part.residual_ut;
      jacobian.middleRows<3>(rows) = part.jacobian;
      variance.segment<3>(rows).setConstant(sensor_variance + map_sigma * map_sigma);
      by_clock.segment<3>(rows) = part.jacobian.rightCols<3>() * (T_map_imu.rotation * reading.velocity_m_s);
      rows += 3;
      taken.sensor_variance_ut2 = sensor_variance;
      taken.sigma_ut = std::sqrt(sensor_variance +
                                 std::max(inflation * crowding * map_sigma * map_sigma, weighting.error_variance_ut2));
      result.push_back(taken);
    }
    if (rows == 0) continue;
    ++statistics.arrays;
    statistics.residual_squared_sum += residual.head(rows).squaredNorm();
    statistics.components += static_cast<int>(rows);
    double weight = 1.0;
    if (options.huber) {
      const Eigen::VectorXd difference = residual.head(rows);
      Eigen::MatrixXd innovation = jacobian.topRows(rows) * covariance * jacobian.topRows(rows).transpose();
      innovation += std::pow(weighting.clock.sigma_s, 2) * by_clock.head(rows) * by_clock.head(rows).transpose();
      innovation.diagonal() += variance.head(rows);
      ArrayJudgement judgement(difference, innovation);
      for (const Eigen::Index contradicted : judgement.set_aside(weighting.sensor_gate)) {
        ++statistics.set_aside;
        result[first + static_cast<std::size_t>(contradicted)].weight = 0.0;
      }
      const double distance = judgement.distance();
      statistics.innovation_sum += distance * distance;
      statistics.innovations += 3 * judgement.kept();
      const double limit = mahalanobis_quantile(3 * judgement.kept(), options.huber_probability);
      weight = std::pow(huber_weight(distance, limit), options.huber_power);
    }
    statistics.weight_sum += weight;
    if (weight < 0.5) ++statistics.rejected;
    for (std::size_t i = first; i < result.size(); ++i) result[i].weight *= weight;
  }
  return result;
}

}  // namespace lodestone
