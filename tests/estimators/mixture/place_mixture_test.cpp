#include "estimators/mixture/place_mixture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/imu/propagation.h"
#include "estimators/initial_state.h"
#include "estimators/mixture/magnetic_mixture.h"
#include "tests/estimators/baselines/striped_field.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

/// A turning and accelerating motion of 0.1 s.
std::vector<ImuSample> turning_imu() {
  std::vector<ImuSample> imu;
  for (int i = 0; i <= 40; ++i) {
    const double s = 0.0025 * i;
    imu.push_back({from_seconds(s), {0.3 - s, 0.2, 1.0 + 2.0 * s}, {1.0 + 4.0 * s, -0.5, 9.6}});
  }
  return imu;
}

NavState tilted_state() {
  NavState state;
  state.T_map_imu = {so3::exp({0.05, -0.1, 1.2}), {3.0, -2.0, 0.4}};
  state.velocity = {1.0, -0.5, 0.1};
  state.gyroscope_bias = {0.01, -0.02, 0.005};
  state.accelerometer_bias = {0.1, 0.05, -0.2};
  return state;
}

TEST(PlaceTransition, IsThatOfSmallSteps) {
  const std::vector<ImuSample> imu = turning_imu();
  const NavState before = tilted_state();
  ImuNoise noise;
  const Preintegration increment(imu, before.gyroscope_bias, before.accelerometer_bias, noise);
  Vector17 sigmas;
  sigmas << Vector3::Constant(0.02), Vector3::Constant(0.1), Vector3::Constant(0.3), Vector3::Constant(0.02),
      Vector3::Constant(0.1), Eigen::Vector2d::Constant(0.01);
  const Matrix17 prior = sigmas.cwiseAbs2().asDiagonal();
  Matrix17 expected = prior;
  propagate(before, imu, noise, &expected);
  const PlaceTransition transition = place_transition(increment, before, noise);
  const Matrix17 found = transition.by_state * prior * transition.by_state.transpose() + transition.noise;
  const Vector17 scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (found - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 2e-3);
}

TEST(PlaceTransition, DerivesThePrediction) {
  const std::vector<ImuSample> imu = turning_imu();
  const NavState before = tilted_state();
  const Preintegration increment(imu, before.gyroscope_bias, before.accelerometer_bias, ImuNoise{});
  const Matrix17 F = place_transition(increment, before, ImuNoise{}).by_state;
  const NavState after = increment.predict(before);
  constexpr double h = 1e-5;
  for (int i = 0; i < tangent::size; ++i) {
    const Vector17 up = increment.predict(before.boxplus(h * Vector17::Unit(i))).boxminus(after);
    const Vector17 down = increment.predict(before.boxplus(-h * Vector17::Unit(i))).boxminus(after);
    EXPECT_LT(((up - down) / (2.0 * h) - F.col(i)).cwiseAbs().maxCoeff(), 1e-6) << "column " << i;
  }
}

struct Moments {
  NavState mean;
  Matrix17 covariance = Matrix17::Zero();
};

Moments moments_of(const PlaceMixture& mixture) {
  const NavState& reference = mixture.components().front().state;
  Vector17 mean = Vector17::Zero();
  for (const PlaceComponent& one : mixture.components()) {
    mean += std::exp(one.log_weight) * one.state.boxminus(reference);
  }
  Moments result{reference.boxplus(mean)};
  for (const PlaceComponent& one : mixture.components()) {
    const Vector17 apart = one.state.boxminus(result.mean);
    result.covariance +=
        std::exp(one.log_weight) * (one.covariance.topLeftCorner<17, 17>() + apart * apart.transpose());
  }
  return result;
}

/// The same input with two layers, so that the map's height is no measurement.
EstimatorInput with_two_layers(EstimatorInput input) {
  FieldGrid grid = input.field->grid();
  grid.heights_m = {0.0, 5.0};
  const std::vector<Eigen::Vector4f> nodes(static_cast<std::size_t>(2 * grid.rows * grid.columns),
                                           {20.0F, 0.0F, -40.0F, 0.3F});
  input.field = std::make_shared<MagneticMap>(grid, nodes, 3.0);
  return input;
}

// Without readings, splitting and merging change neither mean nor covariance: those of one Kalman filter.
TEST(PlaceMixture, WithoutReadingsHasTheMomentsOfOneGaussian) {
  const StripedField stripes;
  EstimatorInput input = with_two_layers(stripes.input);
  input.options.initial.velocity_sigma_m_s = 0.2;
  PlaceMixture mixture(input);
  const InitialState initial =
      initial_state(input.initial_pose, input.initial_velocity, input.suite.gravity_m_s2, input.options.initial);
  NavState state = initial.state;
  Matrix17 covariance = initial.covariance;
  for (ScanBundle& bundle : stripes.drive(1.5, 1)) {
    bundle.magnetic.clear();
    mixture.process(bundle);
    state = propagate(state, bundle.imu, input.suite.imu, &covariance);
  }
  EXPECT_GT(mixture.components().size(), 20U);
  const Moments found = moments_of(mixture);
  EXPECT_LT((found.mean.T_map_imu.position - state.T_map_imu.position).norm(), 5e-3);
  EXPECT_LT((found.mean.velocity - state.velocity).norm(), 5e-3);
  for (int i = 0; i < tangent::size; ++i)
    EXPECT_NEAR(found.covariance(i, i) / covariance(i, i), 1.0, 0.1) << i;  // light components are discarded
}

// The number of components is that of places two sigmas apart, however large the sigma that is split.
TEST(PlaceMixture, PlacesWithinTwoSigmasBecomeOne) {
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.options.initial.position_sigma_m = 0.4;
  input.options.initial.velocity_sigma_m_s = 0.01;
  PlaceMixture mixture(input);
  for (ScanBundle& bundle : stripes.drive(0.5, 1)) {
    bundle.magnetic.clear();
    mixture.process(bundle);
  }
  EXPECT_LT(mixture.components().size(), 600U);
}

TEST(PlaceMixture, SumOfWeightsIsOneAndTheHeaviestIsFirst) {
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.options.initial.position_sigma_m = 0.5;
  PlaceMixture mixture(input);
  for (const ScanBundle& bundle : stripes.drive(2.0, 3)) {
    mixture.process(bundle);
    double sum = 0.0, before = 0.0;
    for (const PlaceComponent& one : mixture.components()) {
      EXPECT_LE(one.log_weight, before);
      before = one.log_weight;
      sum += std::exp(one.log_weight);
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
  }
  EXPECT_GT(mixture.components().size(), 1U);
}

// Five seconds without readings, begun with a velocity that is 0.3 m/s off.
TEST(PlaceMixture, FollowsTheWheels) {
  const StripedField stripes;
  EstimatorInput input = with_two_layers(stripes.input);
  input.initial_velocity.x() -= 0.3;
  input.options.initial.velocity_sigma_m_s = 0.3;
  input.suite.wheels.emplace();
  PlaceMixture mixture(input);
  for (ScanBundle& bundle : stripes.drive(5.0, 9)) {
    bundle.magnetic.clear();
    bundle.wheels.push_back({bundle.scan.end, StripedField::kSpeed_m_s, 0.0, 0.0});
    mixture.process(bundle);
    EXPECT_GT(mixture.wheel_weight(), 0.0);
  }
  const Moments found = moments_of(mixture);
  EXPECT_NEAR(found.mean.T_map_imu.position.x(), 5.0, 0.3);
  EXPECT_NEAR(found.mean.velocity.x(), 1.0, 0.05);
  EXPECT_LT(std::sqrt(found.covariance(tangent::position, tangent::position)), 0.3);
}

// The field repeats itself every metre, and the initial pose is a metre off. Past the last stripe the readings decide,
// also on the places before.
TEST(MagneticMixture, ChoosesPlacesWithLaterReadings) {
  const StripedField stripes;
  EstimatorInput input = stripes.input;
  input.initial_pose.position.x() -= 1.0;
  input.options.initial.position_sigma_m = 0.6;
  MagneticMixture estimator(input);
  Collector result;
  for (const ScanBundle& bundle : stripes.drive(9.0, 5)) estimator.process(bundle, result);
  estimator.finish(result);
  ASSERT_EQ(result.best_estimates.size(), result.causal_estimates.size());
  EXPECT_GT(std::sqrt(result.causal_estimates[25].covariance(3, 3)), 0.2);
  for (const Estimate& best : result.best_estimates) {
    const Vector3 error = best.state.T_map_imu.position - StripedField::truth(best.time).position;
    EXPECT_LT(error.head<2>().norm(), 0.15) << to_seconds(best.time);
    EXPECT_LT(std::sqrt(best.covariance(3, 3)), 0.3) << to_seconds(best.time);
  }
}

// A magnetometer that has drifted since the survey, also far beyond the sigma of its offset.
TEST(MagneticMixture, EstimatesAnOffset) {
  for (const double offset_ut : {12.0, 45.0}) {
    const StripedField stripes;
    EstimatorInput input = stripes.input;
    input.suite.calibration.magnetometers.offset_sigma_ut = 1.0;
    PlaceMixture mixture(input);
    double largest_m = 0.0;
    for (ScanBundle& bundle : stripes.drive(8.0, 7)) {
      for (MagneticArraySample& sample : bundle.magnetic) sample.field_ut[2]->z() += offset_ut;
      mixture.process(bundle);
      const Vector3 error =
          mixture.components().front().state.T_map_imu.position - StripedField::truth(bundle.scan.end).position;
      largest_m = std::max(largest_m, error.head<2>().norm());
    }
    const PlaceComponent& heaviest = mixture.components().front();
    EXPECT_LT((heaviest.state.T_map_imu.position - StripedField::truth(from_seconds(8.0)).position).head<2>().norm(),
              0.05)
        << offset_ut;
    EXPECT_NEAR(heaviest.offsets_ut[8], offset_ut, 2.0);
    EXPECT_LT(largest_m, 0.05) << offset_ut;
  }
}

}  // namespace
}  // namespace lodestone::testing
