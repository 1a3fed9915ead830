#include <gtest/gtest.h>

#include "core/calibration/magnetometer_calibration.h"
#include "core/observability/parameter_gain.h"

namespace lodestone {
namespace {

Distortion some_distortion() {
  Distortion distortion;
  distortion << 0.03, -0.02, 0.05, 0.01, -0.04, 0.02, 0.03, -0.01, 0.02;
  return distortion;
}

TEST(MagnetometerCalibration, TakesOffWhatItSaysWasPutOn) {
  const MagnetometerCalibration calibration{Vector3(5.0, -3.0, 8.0), distortion_matrix(some_distortion())};
  const Vector3 field(18.0, 4.0, -42.0);
  EXPECT_LT((calibration.corrected(calibration.distortion * field + calibration.hard_iron_ut) - field).norm(), 1e-12);
}

TEST(MagnetometerCalibration, OneAfterAnotherIsTheirWhole) {
  const MagnetometerCalibration first{Vector3(5.0, -3.0, 8.0), distortion_matrix(some_distortion())};
  const MagnetometerCalibration second{Vector3(-1.0, 2.0, 0.5), distortion_matrix(-0.5 * some_distortion())};
  const Vector3 reading(30.0, -12.0, 25.0);
  EXPECT_LT((second.after(first).corrected(reading) - second.corrected(first.corrected(reading))).norm(), 1e-12);
}

TEST(Distortion, NineNumbersAreAnyMatrix) {
  Matrix3 matrix;
  matrix << 1.1, 0.2, -0.3, 0.4, 0.9, 0.6, -0.1, 0.05, 1.3;
  EXPECT_LT((distortion_matrix(distortion_of(matrix)) - matrix).norm(), 1e-15);
  const Vector3 v(1.0, 2.0, 3.0);
  EXPECT_LT((distortion_jacobian(v) * some_distortion() - (distortion_matrix(some_distortion()) * v - v)).norm(),
            1e-14);
  const Matrix3 Q = so3::exp(Vector3(0.5, 1.0, -0.3)).toRotationMatrix();
  EXPECT_LT((distortion_matrix(turned_distortion(Q) * some_distortion()) -
             Q * distortion_matrix(some_distortion()) * Q.transpose())
                .norm(),
            1e-14);
}

TEST(ParameterGain, HoldsWhatIsNotToldAndKeepsWhatIs) {
  // The sum of two parameters is observed well, their difference not at all; a third parameter halfway.
  const Eigen::Vector3d sigma(10.0, 10.0, 0.1);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  information.topLeftCorner<2, 2>().setOnes();
  information(2, 2) = 3.0 * 100.0;
  const ParameterGain gain = analyse_gain(information, sigma, 0.5);
  ASSERT_EQ(gain.hidden, 1);
  EXPECT_NEAR(gain.gain[1], 0.75, 1e-12);
  EXPECT_NEAR(gain.hidden_share_of(Eigen::Vector3d(1.0, -1.0, 0.0)), 1.0, 1e-12);
  EXPECT_NEAR(gain.hidden_share_of(Eigen::Vector3d(1.0, 1.0, 0.0)), 0.0, 1e-12);
  EXPECT_NEAR(gain.hidden_share()[0], 0.5, 1e-12);
  EXPECT_LT((gain.hidden_rows() * Eigen::Vector3d(7.0, 7.0, 1.0)).norm(), 1e-12);
  // Difference: the prior's 200; sum: 200 / (1 + 200 · 2 / 2).
  const Eigen::Matrix3d covariance = gain.covariance();
  EXPECT_NEAR(Eigen::Vector3d(1.0, -1.0, 0.0).dot(covariance * Eigen::Vector3d(1.0, -1.0, 0.0)), 200.0, 1e-9);
  EXPECT_NEAR(Eigen::Vector3d(1.0, 1.0, 0.0).dot(covariance * Eigen::Vector3d(1.0, 1.0, 0.0)), 200.0 / 201.0, 1e-9);
  EXPECT_NEAR(covariance(2, 2), 0.01 / 4.0, 1e-12);
}

}  // namespace
}  // namespace lodestone
