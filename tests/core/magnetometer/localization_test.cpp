#include "core/magnetometer/localization.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace lodestone {
namespace {

/// A field with gradients in all directions of the plane.
Vector3 rich(const Vector3& p) {
  return {18.0 + 8.0 * std::sin(1.9 * p.x() + 0.3) + 5.0 * std::cos(2.3 * p.y()),
          -3.0 + 7.0 * std::cos(1.4 * p.x() - 1.1 * p.y()), -42.0 + 6.0 * std::sin(2.1 * p.y() + 0.7 * p.x())};
}

Vector3 uniform(const Vector3&) {
  return {18.0, -3.0, -42.0};
}

/// Changes only along y.
Vector3 striped(const Vector3& p) {
  return {18.0, -3.0 + 8.0 * std::sin(2.0 * p.y()), -42.0 + 6.0 * std::cos(2.0 * p.y())};
}

template <class Field>
MagneticMap make_map(const Field& field, float sigma = 0.1F) {
  FieldGrid grid{0.05, {-2.0, -2.0}, 81, 81, {0.1}};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 b = field(Vector3(-2.0 + 0.05 * column, -2.0 + 0.05 * row, 0.1));
      nodes.emplace_back(static_cast<float>(b.x()), static_cast<float>(b.y()), static_cast<float>(b.z()), sigma);
    }
  }
  return {grid, nodes, 1.0};
}

SensorSuite array(double noise) {
  SensorSuite suite;
  for (int j = 0; j < 8; ++j) {
    MagnetometerModel model;
    model.T_imu_mag = {so3::exp(Vector3(0.1 * j, 0.0, j < 4 ? 0.0 : 3.1)),
                       Vector3(j < 4 ? 0.3 : -0.3, 0.25 - 0.1667 * (j % 4), -0.1)};
    model.noise_ut = noise;
    suite.magnetometers.push_back(model);
  }
  return suite;
}

template <class Field>
MagneticArraySample measure(const Field& field, const SensorSuite& suite, const Pose& truth, double noise,
                            std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  MagneticArraySample sample;
  for (const MagnetometerModel& model : suite.magnetometers) {
    const Pose T_map_mag = truth * model.T_imu_mag;
    sample.field_ut.emplace_back(T_map_mag.rotation.conjugate() * field(T_map_mag.position) +
                                 noise * Vector3(normal(generator), normal(generator), normal(generator)));
  }
  return sample;
}

Matrix6 prior_covariance(double degrees, double metres) {
  Vector6 sigma;
  sigma << Vector3::Constant(degrees * M_PI / 180.0), Vector3::Constant(metres);
  return sigma.cwiseAbs2().asDiagonal();
}

const Pose truth{so3::exp(Vector3(0.01, -0.02, 0.7)), Vector3(0.2, -0.3, 0.2)};

/// Number of directions that the field does not observe.
Eigen::Index unseen_in(const MagneticLocalization& result) {
  return (result.gain.array() < MagneticLocalizationOptions{}.unseen_gain).count();
}

TEST(MagneticLocalizationTest, FindsThePoseWhereTheFieldIsRich) {
  const SensorSuite suite = array(0.2);
  for (const FieldInterpolation interpolation : {FieldInterpolation::bilinear, FieldInterpolation::bicubic}) {
    const MagneticMap map = make_map(rich);
    std::mt19937_64 generator(1);
    std::normal_distribution<double> normal;
    MagneticLocalizationOptions options;
    options.interpolation = interpolation;
    const Matrix6 prior = prior_covariance(3.0, 0.1);
    double nees = 0.0;
    double plane = 0.0;
    constexpr int runs = 200;
    for (int i = 0; i < runs; ++i) {
      Vector6 error;
      for (int k = 0; k < 6; ++k) error[k] = std::sqrt(prior(k, k)) * normal(generator);
      const Pose predicted = truth.boxplus(error);
      const auto result = localize(predicted, prior, measure(rich, suite, truth, 0.2, generator), suite, map, options);
      EXPECT_TRUE(result.converged);
      EXPECT_EQ(result.used, 8);
      EXPECT_EQ(result.off_map, 0);
      const Vector6 off = result.T_map_imu.boxminus(truth);
      plane += off.segment<2>(3).squaredNorm();
      nees += off.dot(result.covariance.ldlt().solve(off)) / 6.0;
    }
    std::printf("plane error %.4f m rms, nees %.2f\n", std::sqrt(plane / runs), nees / runs);
    EXPECT_LT(std::sqrt(plane / runs), 0.02);
    EXPECT_GT(nees / runs, 0.5);
    EXPECT_LT(nees / runs, 1.3);
  }
}

TEST(MagneticLocalizationTest, LeavesUnseenDirectionsAtThePrediction) {
  const SensorSuite suite = array(0.5);
  std::mt19937_64 generator(2);
  const Matrix6 prior = prior_covariance(2.0, 0.1);
  Vector6 error;
  error << 0.01, -0.01, 0.02, 0.08, -0.06, 0.05;
  const Pose predicted = truth.boxplus(error);
  {
    const auto result = localize(predicted, prior, measure(uniform, suite, truth, 0.5, generator), suite,
                                 make_map(uniform), MagneticLocalizationOptions{});
    EXPECT_EQ(unseen_in(result), 4);  // three of position, and rotation about the field itself
    EXPECT_LT((result.T_map_imu.position - predicted.position).norm(), 1e-9);
    EXPECT_NEAR(result.covariance(3, 3), 0.01, 1e-9);
    // Along the observable directions the error is that of eight readings, 0.5 µT / 46 µT / √8 an axis, within three
    // sigma.
    const Vector3 b = Vector3(18.0, -3.0, -42.0).normalized();
    EXPECT_LT((result.T_map_imu.rotation.conjugate() * b - truth.rotation.conjugate() * b).norm(), 0.0163);
  }
  {
    const auto result = localize(predicted, prior, measure(striped, suite, truth, 0.5, generator), suite,
                                 make_map(striped), MagneticLocalizationOptions{});
    EXPECT_EQ(unseen_in(result), 2);  // along the stripes, and the height: one layer has no slope in z
    EXPECT_LT(std::abs(result.T_map_imu.position.x() - predicted.position.x()), 0.02);
    EXPECT_LT(std::abs(result.T_map_imu.position.y() - truth.position.y()), 0.03);
  }
}

TEST(MagneticLocalizationTest, CountsReadingsOffTheMapAndMissingOnes) {
  const SensorSuite suite = array(0.5);
  std::mt19937_64 generator(3);
  const Pose edge{Quaternion::Identity(), Vector3(1.9, 0.0, 0.2)};  // the front row is outside
  MagneticArraySample sample = measure(rich, suite, edge, 0.5, generator);
  sample.field_ut[5].reset();
  const auto result =
      localize(edge, prior_covariance(1.0, 0.1), sample, suite, make_map(rich), MagneticLocalizationOptions{});
  EXPECT_EQ(result.off_map, 4);
  EXPECT_EQ(result.used, 3);
  const Pose outside{Quaternion::Identity(), Vector3(9.0, 0.0, 0.2)};
  const auto nothing =
      localize(outside, prior_covariance(1.0, 0.1), sample, suite, make_map(rich), MagneticLocalizationOptions{});
  EXPECT_EQ(nothing.used, 0);
  EXPECT_EQ(nothing.off_map, 7);
  EXPECT_FALSE(nothing.converged);
  EXPECT_EQ(unseen_in(nothing), 6);
  EXPECT_EQ(nothing.T_map_imu.position, outside.position);
  EXPECT_LT((nothing.covariance - prior_covariance(1.0, 0.1)).norm(), 1e-12);
}

TEST(MagneticLocalizationTest, TakesTheBiasOff) {
  const SensorSuite suite = array(0.2);
  std::mt19937_64 generator(4);
  MagneticArraySample sample = measure(rich, suite, truth, 0.2, generator);
  const MagneticMap map = make_map(rich);
  const Matrix6 prior = prior_covariance(2.0, 0.1);
  const auto clean = localize(truth, prior, sample, suite, map, MagneticLocalizationOptions{});
  std::vector<Vector3> bias;
  for (int j = 0; j < 8; ++j) {
    bias.push_back(Vector3(3.0 * j, -5.0, 40.0));
    *sample.field_ut[j] += bias.back();
  }
  const auto same = localize(truth, prior, sample, suite, map, MagneticLocalizationOptions{}, bias);
  EXPECT_LT(same.T_map_imu.boxminus(clean.T_map_imu).norm(), 1e-9);
}

TEST(MagneticLocalizationTest, RefusesAPriorThatIsNone) {
  const SensorSuite suite = array(0.5);
  std::mt19937_64 generator(5);
  const auto sample = measure(rich, suite, truth, 0.5, generator);
  const MagneticMap map = make_map(rich);
  EXPECT_THROW(localize(truth, Matrix6::Zero(), sample, suite, map, {}), std::invalid_argument);
  EXPECT_THROW(localize(truth, prior_covariance(1, 1), MagneticArraySample{}, suite, map, {}), std::invalid_argument);
}

}  // namespace
}  // namespace lodestone
