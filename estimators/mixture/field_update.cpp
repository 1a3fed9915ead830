#include "estimators/mixture/field_update.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

/// Wider than the structure of the field: the gradient at the mean says nothing. Such a component exists where there
/// are too many to be split.
bool is_wide(const PlaceComponent& component) {
  const double variance = component.covariance.diagonal().segment<2>(tangent::position).maxCoeff();
  return variance > 4.0 * kWidestPlace_m * kWidestPlace_m;
}

}  // namespace

ReadingFit fit_reading(const MeanReading& reading, const PlaceComponent& component, const EstimatorInput& input,
                       const FieldBackground& background) {
  const Pose& T_map_imu = component.state.T_map_imu;
  const Matrix3 R = T_map_imu.rotation.toRotationMatrix();
  const Matrix3 R_imu_mag = reading.T_end_mag.rotation.toRotationMatrix();
  const Eigen::Index at = 3 * reading.magnetometer;
  const Vector3 measured_ut = R_imu_mag * (reading.measured_ut - component.offsets_ut.segment<3>(at));
  const MagnetometerCalibrationSigmas& calibration = input.suite.calibration.magnetometers;
  const double noise_ut = input.suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
  const double relative = std::hypot(calibration.rotation_sigma_deg * M_PI / 180.0, calibration.matrix_sigma);
  ReadingFit result;
  result.sensor_variance_ut2 =
      noise_ut * noise_ut / reading.samples + relative * relative * measured_ut.squaredNorm() / 3.0;
  const auto field = input.field->query(T_map_imu * reading.T_end_mag.position, FieldInterpolation::bicubic);
  if (!field || is_wide(component)) {
    result.residual_ut = background.mean_ut - R * measured_ut;
    result.map_variance_ut2 = background.sigma_ut * background.sigma_ut;
    return result;
  }
  result.informs = true;
  result.residual_ut = field->field_ut - R * measured_ut;
  const double by_place_ut = calibration.translation_sigma_m * field->gradient.norm() / std::sqrt(3.0);
  result.map_variance_ut2 = std::pow(std::max(field->sigma_ut, kMapSigmaFloor_ut), 2) + by_place_ut * by_place_ut;
  result.by_pose.leftCols<3>() = R * so3::hat(measured_ut) - field->gradient * R * so3::hat(reading.T_end_mag.position);
  result.by_pose.rightCols<3>() = field->gradient;
  result.by_offset = R * R_imu_mag;
  result.offset = tangent::size + at;
  return result;
}

double mean_variance_ut2(const Eigen::MatrixXd& covariance, const ReadingFit& found) {
  const Eigen::Matrix<double, 6, 3> crossed =
      covariance.topLeftCorner<6, 6>() * found.by_pose.transpose() +
      2.0 * covariance.block<6, 3>(0, found.offset) * found.by_offset.transpose();
  const Matrix3 by_offset = covariance.block<3, 3>(found.offset, found.offset) * found.by_offset.transpose();
  return (crossed.cwiseProduct(found.by_pose.transpose()).sum() +
          by_offset.cwiseProduct(found.by_offset.transpose()).sum()) /
         3.0;
}

void update_by_readings(std::span<const WeighedFit> readings, PlaceComponent& component) {
  if (readings.empty()) return;
  Eigen::MatrixXd& P = component.covariance;  // its lower triangle, until the end
  const Eigen::Index size = P.cols();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(size);
  Eigen::Matrix<double, Eigen::Dynamic, 3> offset_columns(size, 3), crossed(size, 3), gain(size, 3);
  for (const auto& [found, variance_ut2] : readings) {
    // P Hᵀ of the lower triangle: rows above the offset's are its columns.
    offset_columns.topRows(found.offset) = P.block(found.offset, 0, 3, found.offset).transpose();
    Matrix3 own = P.block<3, 3>(found.offset, found.offset);
    own.triangularView<Eigen::StrictlyUpper>() = own.transpose();
    offset_columns.middleRows<3>(found.offset) = own;
    const Eigen::Index below = size - found.offset - 3;
    offset_columns.bottomRows(below) = P.block(found.offset + 3, found.offset, below, 3);
    Matrix6 pose = P.topLeftCorner<6, 6>();
    pose.triangularView<Eigen::StrictlyUpper>() = pose.transpose();
    crossed = offset_columns.lazyProduct(found.by_offset.transpose());
    crossed.topRows<6>() += pose * found.by_pose.transpose();
    crossed.bottomRows(size - 6) += P.block(6, 0, size - 6, 6).lazyProduct(found.by_pose.transpose());

    Matrix3 innovation = found.by_pose * crossed.topRows<6>() + found.by_offset * crossed.middleRows<3>(found.offset);
    innovation.diagonal().array() += variance_ut2;
    gain = crossed.lazyProduct(innovation.inverse());
    const Vector3 left =
        found.residual_ut + found.by_pose * step.head<6>() + found.by_offset * step.segment<3>(found.offset);
    step -= gain.lazyProduct(left);
    for (Eigen::Index c = 0; c < size; ++c) {
      const Eigen::Index rows = size - c;
      P.col(c).tail(rows) -= crossed(c, 0) * gain.col(0).tail(rows) + crossed(c, 1) * gain.col(1).tail(rows) +
                             crossed(c, 2) * gain.col(2).tail(rows);
    }
  }
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  component.move(step);
}

}  // namespace lodestone
