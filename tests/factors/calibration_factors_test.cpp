#include <gtest/gtest.h>

#include "factors/calibrated_reading_factor.h"
#include "factors/field_step_factor.h"
#include "tests/factors/gradients.h"

namespace lodestone {
namespace {

const double calibration[12] = {1.0, -2.0, 3.0, 0.03, -0.02, 0.05, 0.01, -0.04, 0.02, 0.03, -0.01, 0.02};

TEST(CalibratedReadingFactor, DerivativesAreThoseOfItsResidual) {
  CalibratedReadingFactor::Reading reading;
  reading.measured_ut = Vector3(20.0, -5.0, 40.0);
  reading.known_ut = Vector3(3.0, 4.0, 5.0);
  reading.R_mag_imu = so3::exp(Vector3(0.3, -0.2, 1.0)).toRotationMatrix();
  reading.lever_m = Vector3(0.3, -0.2, 0.1);
  reading.sigma_ut = 0.4;
  reading.anomaly_ut = Vector3(3.0, -1.0, 2.0);
  reading.R_imu_map = so3::exp(Vector3(-0.4, 0.1, 2.0)).toRotationMatrix();
  const double field[3] = {18.0, 4.0, -42.0};
  const double slope[5] = {5.0, -3.0, 2.0, 8.0, -1.0};
  const double coupling[15] = {0.1, -0.2, 0.3, 0.5, 0.4, -0.3, 0.2, 0.0, 0.7, -0.6, 0.3, 0.1, 0.2, -0.5, 0.4};
  reading.usual_ut = Vector3(2.0, 1.0, 7.0);
  const double change[4] = {0.2, 3.0, -1.0, 4.0}, variation[1] = {0.1};
  for (const bool mapped : {false, true}) {
    if (mapped) reading.last_distortion = Matrix3::Identity() + 0.1 * so3::hat(Vector3(0.2, -0.5, 0.3));
    expect_gradients(CalibratedReadingFactor(reading), {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr},
                     {calibration, field, slope, coupling, change, variation});
  }
}

TEST(CalibratedReadingFactor, IsZeroForAReadingThatItsCalibrationMakes) {
  const Matrix3 Q = so3::exp(Vector3(0.3, -0.2, 1.0)).toRotationMatrix();
  const Vector3 field(18.0, 4.0, -42.0);
  const Vector3 lever(0.3, -0.2, 0.1);
  Matrix3 slope;
  slope << 5.0, 2.0, 8.0, 2.0, -3.0, -1.0, 8.0, -1.0, -2.0;
  const Matrix3 D = distortion_matrix(Eigen::Map<const Distortion>(calibration + 3));
  const Vector3 measured = D * Q * (field + slope * lever) + Vector3(1.0, -2.0, 3.0);
  const double five[5] = {5.0, -3.0, 2.0, 8.0, -1.0};
  const double none[15] = {};
  const double* parameters[6] = {calibration, field.data(), five, none, none, none};
  Vector3 residual;
  CalibratedReadingFactor({measured, Vector3::Zero(), Q, lever, 0.1, Vector3::Zero()})
      .Evaluate(parameters, residual.data(), nullptr);
  EXPECT_LT(residual.norm(), 1e-10);
}

TEST(CalibratedReadingFactor, AChangeOfTheMapScalesItsFieldAndAddsAVectorInMapAxes) {
  const Matrix3 Q = so3::exp(Vector3(0.3, -0.2, 1.0)).toRotationMatrix();
  const Matrix3 R_imu_map = so3::exp(Vector3(0.1, 0.2, -2.0)).toRotationMatrix();
  const Vector3 mapped(18.0, 4.0, -42.0), offset(3.0, -1.0, 4.0);
  const Matrix3 D = distortion_matrix(Eigen::Map<const Distortion>(calibration + 3));
  const Vector3 measured = D * Q * R_imu_map * (1.2 * mapped + offset) + Vector3(1.0, -2.0, 3.0);
  const double none[15] = {}, change[4] = {0.2, offset.x(), offset.y(), offset.z()};
  const double* parameters[6] = {calibration, none, none, none, change, none};
  Vector3 residual;
  CalibratedReadingFactor(
      {measured, R_imu_map * mapped, Q, Vector3(0.3, -0.2, 0.1), 0.1, Vector3::Zero(), R_imu_map, Vector3::Zero(), D})
      .Evaluate(parameters, residual.data(), nullptr);
  EXPECT_LT(residual.norm(), 1e-10);
}

TEST(FieldStepFactor, DerivativesAreThoseOfItsResidual) {
  FieldStepFactor::Step step;
  step.turn = so3::exp(Vector3(0.1, -0.4, 0.7));
  step.turn_by_bias << -0.5, 0.02, 0.0, -0.01, -0.48, 0.03, 0.02, 0.0, -0.5;
  step.after_weight = 3.0;
  step.before_weight = 2.5;
  const double before[3] = {18.0, 4.0, -42.0}, after[3] = {10.0, 14.0, -40.0};
  const double bias[3] = {0.01, -0.02, 0.03};
  expect_gradients(FieldStepFactor(step), {nullptr, nullptr, nullptr, nullptr}, {before, after, calibration + 3, bias});
}

TEST(FieldStepFactor, ScaleOfTheCommonDistortionDoesNotMatter) {
  FieldStepFactor::Step step;
  step.turn = so3::exp(Vector3(0.1, -0.4, 0.7));
  const double before[3] = {18.0, 4.0, -42.0}, after[3] = {10.0, 14.0, -40.0}, bias[3] = {0.0, 0.0, 0.0};
  const double none[9] = {}, larger[9] = {0.2, 0.2, 0.2};
  Vector3 first, second;
  const double* parameters[4] = {before, after, none, bias};
  FieldStepFactor(step).Evaluate(parameters, first.data(), nullptr);
  parameters[2] = larger;
  FieldStepFactor(step).Evaluate(parameters, second.data(), nullptr);
  EXPECT_LT((first - second).norm(), 1e-12);
}

TEST(SlopeOfTheField, TurnsAsItsMatrixDoes) {
  const Matrix3 Q = so3::exp(Vector3(0.5, 1.0, -0.3)).toRotationMatrix();
  const FieldSlope slope(5.0, -3.0, 2.0, 8.0, -1.0);
  const Vector3 lever(0.3, -0.2, 0.1);
  EXPECT_LT((slope_jacobian(Q * lever) * turned_slope(Q) * slope - Q * (slope_jacobian(lever) * slope)).norm(), 1e-12);
}

}  // namespace
}  // namespace lodestone
