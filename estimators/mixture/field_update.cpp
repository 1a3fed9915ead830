#include "estimators/mixture/field_update.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

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

void FieldUpdate::add(const PlaceComponent& component, const ReadingFit& found, double variance_ut2) {
  const Eigen::Index size = component.covariance.cols();
  if (step_.size() == 0) {
    covariance_ = component.covariance;
    step_.setZero(size);
  }
  // P Hᵀ of the lower triangle: rows above the offset's are its columns.
  offset_columns_.resize(size, 3);
  offset_columns_.topRows(found.offset) = covariance_.block(found.offset, 0, 3, found.offset).transpose();
  Matrix3 own = covariance_.block<3, 3>(found.offset, found.offset);
  own.triangularView<Eigen::StrictlyUpper>() = own.transpose();
  offset_columns_.middleRows<3>(found.offset) = own;
  const Eigen::Index below = size - found.offset - 3;
  offset_columns_.bottomRows(below) = covariance_.block(found.offset + 3, found.offset, below, 3);
  Matrix6 pose = covariance_.topLeftCorner<6, 6>();
  pose.triangularView<Eigen::StrictlyUpper>() = pose.transpose();
  crossed_ = offset_columns_.lazyProduct(found.by_offset.transpose());
  crossed_.topRows<6>() += pose * found.by_pose.transpose();
  crossed_.bottomRows(size - 6) += covariance_.block(6, 0, size - 6, 6).lazyProduct(found.by_pose.transpose());

  Matrix3 innovation = found.by_pose * crossed_.topRows<6>() + found.by_offset * crossed_.middleRows<3>(found.offset);
  innovation.diagonal().array() += variance_ut2;
  gain_ = crossed_.lazyProduct(innovation.inverse());
  const Vector3 left =
      found.residual_ut + found.by_pose * step_.head<6>() + found.by_offset * step_.segment<3>(found.offset);
  step_ -= gain_.lazyProduct(left);
  for (Eigen::Index c = 0; c < size; ++c) {
    const Eigen::Index rows = size - c;
    covariance_.col(c).tail(rows) -= crossed_(c, 0) * gain_.col(0).tail(rows) +
                                     crossed_(c, 1) * gain_.col(1).tail(rows) +
                                     crossed_(c, 2) * gain_.col(2).tail(rows);
  }
}

void FieldUpdate::apply(PlaceComponent& component) {
  if (step_.size() == 0) return;
  covariance_.triangularView<Eigen::StrictlyUpper>() = covariance_.transpose();
  component.covariance = std::move(covariance_);
  component.move(step_);
  step_.resize(0);
}

}  // namespace lodestone
