// One component and the readings of an array: the derivatives, and the update against that of all readings at once.
#include "estimators/mixture/field_update.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "tests/estimators/baselines/striped_field.h"

namespace lodestone::testing {
namespace {

constexpr Eigen::Index kSize = tangent::size + 12;  // four magnetometers

PlaceComponent place_over_stripes() {
  PlaceComponent result;
  result.state.T_map_imu = {so3::exp({0.05, -0.1, 1.2}), {1.3, 0.4, 0.2}};
  RandomStream random(4, "a component over stripes");
  result.offsets_ut.resize(12);
  for (double& offset_ut : result.offsets_ut) offset_ut = random.normal();
  Eigen::MatrixXd root(kSize, kSize);
  for (double& one : root.reshaped()) one = random.normal();
  Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(kSize, 0.01);
  sigmas.tail(12).setConstant(0.5);
  result.covariance = sigmas.asDiagonal() * (root * root.transpose() / kSize) * sigmas.asDiagonal();
  return result;
}

std::vector<MeanReading> readings_over(const StripedField& stripes) {
  std::vector<MeanReading> result;
  for (int i = 0; i < 4; ++i) {
    MeanReading reading;
    reading.T_end_mag = {so3::exp({0.02, 0.03 * i, -0.4}),
                         stripes.input.suite.magnetometers[static_cast<std::size_t>(i)].T_imu_mag.position};
    reading.measured_ut = {18.0 + i, 7.0, -39.0 - i};
    reading.magnetometer = i;
    reading.samples = 2;
    result.push_back(reading);
  }
  return result;
}

Eigen::MatrixXd dense_derivative(const ReadingFit& found) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, kSize);
  H.leftCols<6>() = found.by_pose;
  H.middleCols<3>(found.offset) = found.by_offset;
  return H;
}

TEST(FitReading, DerivativesAreThoseOfSmallSteps) {
  const StripedField stripes;
  const FieldBackground background = field_background(*stripes.input.field);
  const PlaceComponent at = place_over_stripes();
  for (const MeanReading& reading : readings_over(stripes)) {
    const ReadingFit found = fit_reading(reading, at, stripes.input, background);
    ASSERT_TRUE(found.informs);
    constexpr double kStep = 1e-5;
    Eigen::MatrixXd numeric(3, kSize);
    for (Eigen::Index k = 0; k < kSize; ++k) {
      PlaceComponent before = at, after = at;
      before.move(-kStep * Eigen::VectorXd::Unit(kSize, k));
      after.move(kStep * Eigen::VectorXd::Unit(kSize, k));
      numeric.col(k) = (fit_reading(reading, after, stripes.input, background).residual_ut -
                        fit_reading(reading, before, stripes.input, background).residual_ut) /
                       (2.0 * kStep);
    }
    EXPECT_LT((dense_derivative(found) - numeric).norm(), 1e-3 * numeric.norm()) << reading.magnetometer;
    EXPECT_NEAR(mean_variance_ut2(at.covariance, found),
                (dense_derivative(found) * at.covariance * dense_derivative(found).transpose()).trace() / 3.0, 1e-9);
  }
}

TEST(FitReading, OffTheMapAndInAWideComponentTheFieldIsThatOfTheWholeMap) {
  const StripedField stripes;
  const FieldBackground background = field_background(*stripes.input.field);
  PlaceComponent outside = place_over_stripes(), wide = place_over_stripes();
  outside.state.T_map_imu.position.x() = 200.0;
  wide.covariance(tangent::position, tangent::position) = 5.0 * kWidestPlace_m * kWidestPlace_m;
  for (const PlaceComponent& one : {outside, wide}) {
    const ReadingFit found = fit_reading(readings_over(stripes).front(), one, stripes.input, background);
    EXPECT_FALSE(found.informs);
    EXPECT_EQ(found.map_variance_ut2, background.sigma_ut * background.sigma_ut);
  }
}

// Readings one after the other, with nine columns each, are the update by all of them at once.
TEST(UpdateByReadings, IsThatOfAllOfThemTogether) {
  const StripedField stripes;
  const FieldBackground background = field_background(*stripes.input.field);
  const PlaceComponent before = place_over_stripes();
  std::vector<WeighedFit> readings;
  Eigen::MatrixXd H(12, kSize);
  Eigen::VectorXd residual(12), variances(12);
  for (const MeanReading& reading : readings_over(stripes)) {
    const ReadingFit found = fit_reading(reading, before, stripes.input, background);
    const Eigen::Index row = 3 * reading.magnetometer;
    H.middleRows<3>(row) = dense_derivative(found);
    residual.segment<3>(row) = found.residual_ut;
    variances.segment<3>(row).setConstant(0.3 + reading.magnetometer);
    readings.push_back({found, 0.3 + reading.magnetometer});
  }
  PlaceComponent after = before;
  update_by_readings(readings, after);

  Eigen::MatrixXd innovation = H * before.covariance * H.transpose();
  innovation.diagonal() += variances;
  const Eigen::MatrixXd gain = before.covariance * H.transpose() * innovation.inverse();
  PlaceComponent expected = before;
  expected.move(-gain * residual);
  const Eigen::MatrixXd covariance = before.covariance - gain * H * before.covariance;
  EXPECT_LT(step_between(expected, after).norm(), 1e-9);
  EXPECT_LT((after.covariance - covariance).norm(), 1e-9 * covariance.norm());
  EXPECT_EQ(after.covariance, after.covariance.transpose());

  const PlaceComponent same = after;
  update_by_readings({}, after);
  EXPECT_EQ(after.covariance, same.covariance);
  EXPECT_EQ(after.state.T_map_imu.position, same.state.T_map_imu.position);
}

}  // namespace
}  // namespace lodestone::testing
