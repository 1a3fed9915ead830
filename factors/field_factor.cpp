#include "factors/field_factor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/magnetometer/field_residual.h"
#include "factors/calibration_estimate.h"
#include "factors/manifolds.h"

namespace lodestone {

namespace {

constexpr int kMatrix = CalibrationEstimate::kMatrixParameters;

}  // namespace

FieldFactor::FieldFactor(std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation, int magnetometers,
                         std::vector<FieldReading> readings, const PoseMask& mask, const Blocks& blocks)
    : map_(std::move(map)),
      interpolation_(interpolation),
      magnetometers_(magnetometers),
      blocks_(blocks),
      readings_(std::move(readings)),
      mask_(mask) {
  set_num_residuals(3 * static_cast<int>(readings_.size()));
  mutable_parameter_block_sizes()->push_back(7);
  mutable_parameter_block_sizes()->push_back(3 * magnetometers);
  if (blocks.clock) mutable_parameter_block_sizes()->push_back(1);
  if (blocks.matrices) mutable_parameter_block_sizes()->push_back(kMatrix * magnetometers);
}

void FieldFactor::renew(std::vector<FieldReading> readings, const PoseMask& mask) {
  if (readings.size() != readings_.size()) throw std::invalid_argument("FieldFactor: the number of readings is fixed");
  readings_ = std::move(readings);
  mask_ = mask;
}

std::optional<FieldValue> FieldReading::field_beyond(const Vector3& position) const {
  std::optional<FieldValue> result = field;
  if (result) result->field_ut += result->gradient * (position - place);
  return result;
}

bool FieldFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const bool by_pose = jacobians != nullptr && jacobians[0] != nullptr;
  const bool by_bias = jacobians != nullptr && jacobians[1] != nullptr;
  Matrix6 seen_by_pose;
  const Pose seen = mask_.apply(to_pose(parameters[0]), by_pose ? &seen_by_pose : nullptr);
  const bool by_clock = blocks_.clock && jacobians != nullptr && jacobians[2] != nullptr;
  const std::size_t matrices = blocks_.clock ? 3 : 2;
  const bool by_matrices = blocks_.matrices && jacobians != nullptr && jacobians[matrices] != nullptr;
  const int matrix_columns = kMatrix * magnetometers_;
  if (by_matrices) std::fill_n(jacobians[matrices], num_residuals() * matrix_columns, 0.0);
  const int bias_columns = 3 * magnetometers_;
  if (by_bias) std::fill_n(jacobians[1], num_residuals() * bias_columns, 0.0);
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    const FieldReading& reading = readings_[i];
    Eigen::Map<Vector3> residual(residuals + 3 * i);
    double* pose_rows = by_pose ? jacobians[0] + 3 * 7 * i : nullptr;
    const Pose T_end_mag = blocks_.clock ? reading.T_end_mag_at(parameters[2][0]) : reading.T_end_mag;
    const Vector3 place = seen * T_end_mag.position;
    auto field = map_->query(place, interpolation_);
    if (!field) field = reading.field_beyond(place);
    if (!field) {
      residual.setZero();
      if (by_pose) std::fill_n(pose_rows, 3 * 7, 0.0);
      if (by_clock) std::fill_n(jacobians[2] + 3 * i, 3, 0.0);
      continue;
    }
    const double scale = std::sqrt(reading.weight) / reading.sigma_ut;
    const Vector3 bias(parameters[1] + 3 * reading.magnetometer);
    const FieldResidual part = field_residual(seen, T_end_mag, reading.measured_ut - bias, *field);
    const Vector3 expected_ut = reading.measured_ut - bias - part.residual_ut;
    Matrix3 read = Matrix3::Identity();
    if (blocks_.matrices) {
      read += CalibrationEstimate::matrix_of(parameters[matrices] + kMatrix * reading.magnetometer);
    }
    residual = scale * (reading.measured_ut - bias - read * expected_ut);
    const Eigen::Matrix<double, 3, 6> by_tangent = scale * read * part.jacobian;
    if (by_pose) to_ambient(parameters[0], by_tangent * seen_by_pose, pose_rows);
    if (by_clock) {
      Eigen::Map<Vector3>(jacobians[2] + 3 * i) = -by_tangent.rightCols<3>() * (seen.rotation * reading.velocity_m_s) -
                                                  scale * read * reading.turn_rad_s.cross(expected_ut);
    }
    if (by_matrices) {
      // E m = −θ × m + S m.
      const Vector3& m = expected_ut;
      Eigen::Matrix<double, 3, kMatrix> by_parameters;
      by_parameters << so3::hat(m), Eigen::Matrix<double, 3, 6>::Zero();
      by_parameters.rightCols<6>() << m.x(), m.y(), m.z(), 0.0, 0.0, 0.0, 0.0, m.x(), 0.0, m.y(), m.z(), 0.0, 0.0, 0.0,
          m.x(), 0.0, m.y(), m.z();
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(
          jacobians[matrices], num_residuals(), matrix_columns);
      all.block<3, kMatrix>(3 * static_cast<Eigen::Index>(i), kMatrix * reading.magnetometer) = -scale * by_parameters;
    }
    if (by_bias) {
      for (int axis = 0; axis < 3; ++axis) {
        jacobians[1][(3 * static_cast<int>(i) + axis) * bias_columns + 3 * reading.magnetometer + axis] = -scale;
      }
    }
  }
  return true;
}

}  // namespace lodestone
