#include "core/mapping/sliding_gpr.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "core/error.h"
#include "core/mapping/field_kernel_fit.h"

namespace lodestone {
namespace {

/// A draw of a field with squared-exponential covariance, by random Fourier features: 400 plane waves a component.
class RandomField {
 public:
  RandomField(double sigma, double length_scale, std::uint64_t seed) : sigma_(sigma) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    for (auto& component : waves_) {
      for (auto& wave : component) {
        wave.frequency = Vector3(normal(generator), normal(generator), normal(generator)) / length_scale;
        wave.phase = 2.0 * M_PI * static_cast<double>(generator() >> 11) * 0x1.0p-53;
      }
    }
  }
  Vector3 operator()(const Vector3& p) const {
    Vector3 value(20.0, -3.0, -44.0);
    for (int i = 0; i < 3; ++i) {
      double sum = 0.0;
      for (const auto& wave : waves_[i]) sum += std::cos(wave.frequency.dot(p) + wave.phase);
      value[i] += sigma_ * std::sqrt(2.0 / static_cast<double>(waves_[i].size())) * sum;
    }
    return value;
  }

 private:
  struct Wave {
    Vector3 frequency;
    double phase = 0.0;
  };
  double sigma_;
  std::array<std::array<Wave, 400>, 3> waves_;
};

/// Lanes along x, 0.3 m apart, four readings every 5 cm.
std::vector<FieldObservation> survey(const RandomField& field, double length, int lanes, double noise,
                                     std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<FieldObservation> observations;
  for (int lane = 0; lane < lanes; ++lane) {
    for (double x = 0.0; x < length; x += 0.0125) {
      FieldObservation observation;
      observation.position = Vector3(x, 0.3 * lane + 0.02 * std::sin(x), 0.4);
      observation.field_ut =
          field(observation.position) + noise * Vector3(normal(generator), normal(generator), normal(generator));
      observation.noise_ut = noise;
      observations.push_back(observation);
    }
  }
  return observations;
}

SlidingGpr train(const std::vector<FieldObservation>& observations, double cell, FieldKernelFit* fit_out = nullptr) {
  const SlidingGprOptions options;
  const FieldKernelFit fit = fit_field_kernels(observations, cell, options);
  if (fit_out) *fit_out = fit;
  return SlidingGpr(thin_survey(observations, fit.cell_m), fit.kernels, options);
}

TEST(SlidingGprTest, FindsTheHyperparametersOfTheFieldItWasDrawnFrom) {
  const RandomField field(6.0, 0.5, 1);
  FieldKernelFit fit;
  train(survey(field, 20.0, 8, 1.0, 2), 0.1, &fit);
  for (const KernelParameters& kernel : fit.kernels) {
    EXPECT_NEAR(kernel.length_scale_m, 0.5, 0.075);
    EXPECT_NEAR(kernel.signal_sigma, 6.0, 1.2);
    EXPECT_LT(kernel.noise_sigma, 0.3);
  }
}

TEST(SlidingGprTest, SigmaIsHonestOnHeldOutPoints) {
  struct Case {
    double length_scale;
    double noise;
  };
  for (const Case& test : {Case{0.3, 0.3}, Case{0.5, 1.0}, Case{0.5, 5.0}, Case{1.2, 0.3}}) {
    double squares = 0.0;
    double errors = 0.0;
    double count = 0.0;
    // Errors are correlated over a length scale: one draw is few independent ones.
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      const RandomField field(6.0, test.length_scale, 20 + seed);
      const SlidingGpr gpr = train(survey(field, 7.0, 6, test.noise, 30 + seed), 0.1);
      std::mt19937_64 generator(5 + seed);
      const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1.0p-53; };
      std::vector<Vector3> points;
      for (int i = 0; i < 700; ++i) points.push_back({7.0 * uniform(), -0.2 + 1.9 * uniform(), 0.4});
      const auto predictions = gpr.predict(points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_TRUE(predictions[i].supported);
        const Vector3 error = predictions[i].field_ut - field(points[i]);
        squares += error.cwiseQuotient(predictions[i].sigma_ut).squaredNorm();
        errors += error.squaredNorm();
        count += 3.0;
      }
    }
    const double normalized = std::sqrt(squares / count);
    std::printf("length scale %.1f m, noise %.1f uT: rms error %.3f uT, normalized %.3f\n", test.length_scale,
                test.noise, std::sqrt(errors / count), normalized);
    EXPECT_GT(normalized, 0.8) << test.length_scale << " " << test.noise;
    EXPECT_LT(normalized, 1.25) << test.length_scale << " " << test.noise;
  }
}

TEST(SlidingGprTest, ShowsNoSeamBetweenWindows) {
  const RandomField field(6.0, 0.4, 6);
  FieldKernelFit fit;
  const SlidingGpr gpr = train(survey(field, 6.0, 8, 1.0, 7), 0.1, &fit);
  // Along a line across several windows: second differences stay as small as the field's own curvature allows.
  std::vector<Vector3> line;
  const double step = 0.002;
  for (double x = 1.0; x < 5.0; x += step) line.push_back({x, 1.05, 0.4});
  const auto predictions = gpr.predict(line);
  const double curvature = 6.0 / (0.4 * 0.4) * 6.0;  // σ/l², and six sigma of its draw
  for (std::size_t i = 2; i < line.size(); ++i) {
    const Vector3 second = predictions[i].field_ut - 2.0 * predictions[i - 1].field_ut + predictions[i - 2].field_ut;
    EXPECT_LT(second.cwiseAbs().maxCoeff() / (step * step), curvature);
  }
}

TEST(SlidingGprTest, GivesTheSameBitsOnOneThreadAndOnTwo) {
  const RandomField field(6.0, 0.4, 8);
  const auto observations = survey(field, 5.0, 6, 1.0, 9);
  std::vector<Vector3> points;
  for (int i = 0; i < 500; ++i) points.push_back({0.01 * i, 0.003 * i, 0.4});
  const auto with_threads = [&](int threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return train(observations, 0.1).predict(points);
  };
  const auto one = with_threads(1);
  const auto two = with_threads(2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(one[i].field_ut, two[i].field_ut);
    EXPECT_EQ(one[i].sigma_ut, two[i].sigma_ut);
  }
}

TEST(SlidingGprTest, SaysNothingFarFromTheSurvey) {
  const RandomField field(6.0, 0.4, 10);
  const SlidingGpr gpr = train(survey(field, 5.0, 6, 1.0, 11), 0.1);
  const auto predictions = gpr.predict({{2.0, 0.5, 0.4}, {2.0, 8.0, 0.4}, {-5.0, 0.5, 0.4}, {std::nan(""), 0.5, 0.4}});
  EXPECT_TRUE(predictions[0].supported);
  EXPECT_FALSE(predictions[1].supported);
  EXPECT_FALSE(predictions[2].supported);
  EXPECT_FALSE(predictions[3].supported);
}

TEST(SlidingGprTest, AgreesWithOneExactProcessWhereAllPointsFit) {
  const RandomField field(6.0, 0.8, 12);
  const auto cells = thin_survey(survey(field, 1.5, 4, 1.0, 13), 0.2);
  KernelParameters kernel{0.0, 60.0, 6.0, 0.8, 0.05};
  SlidingGprOptions options;
  options.margin_length_scales = 10.0;
  options.scale_prior_points = 1e12;
  const SlidingGpr gpr(cells, {kernel, kernel, kernel}, options);
  const auto size = static_cast<Eigen::Index>(cells.size());
  ASSERT_LT(size, options.window_points);
  GaussianProcessData data{Eigen::ArrayX3d(size, 3), Eigen::VectorXd(size), Eigen::VectorXd(size)};
  for (Eigen::Index i = 0; i < size; ++i) {
    data.positions.row(i) = cells[i].position.transpose().array();
    data.values[i] = cells[i].field_ut.y();
    data.variance[i] = cells[i].variance_ut2;
  }
  Eigen::ArrayX3d points(3, 3);
  points << 0.2, 0.1, 0.4, 0.7, 0.5, 0.4, 1.2, 0.9, 0.45;
  Eigen::VectorXd mean, variance;
  GaussianProcess(data, kernel).predict(points, mean, variance);
  for (int i = 0; i < 3; ++i) {
    const auto blended = gpr.predict({points.row(i).matrix().transpose()})[0];
    EXPECT_NEAR(blended.field_ut.y(), mean[i], 1e-6);
    EXPECT_NEAR(blended.sigma_ut.y(), std::sqrt(variance[i]), 1e-5);
  }
}

TEST(KernelFitTest, LikelihoodGradientMatchesDifferences) {
  const RandomField field(6.0, 0.5, 14);
  const auto cells = thin_survey(survey(field, 2.0, 4, 1.0, 15), 0.15);
  const auto size = static_cast<Eigen::Index>(cells.size());
  GaussianProcessData data{Eigen::ArrayX3d(size, 3), Eigen::VectorXd(size), Eigen::VectorXd(size)};
  for (Eigen::Index i = 0; i < size; ++i) {
    data.positions.row(i) = cells[i].position.transpose().array();
    data.values[i] = cells[i].field_ut.x();
    data.variance[i] = cells[i].variance_ut2;
  }
  const KernelParameters parameters{18.0, 20.0, 5.0, 0.4, 0.7};
  Eigen::Vector3d gradient;
  log_marginal_likelihood(data, parameters, &gradient);
  const double step = 1e-5;
  for (int i = 0; i < 3; ++i) {
    const auto moved = [&](double by) {
      KernelParameters other = parameters;
      (i == 0 ? other.signal_sigma : i == 1 ? other.length_scale_m : other.noise_sigma) *= std::exp(by);
      return log_marginal_likelihood(data, other);
    };
    EXPECT_NEAR((moved(step) - moved(-step)) / (2.0 * step), gradient[i], 1e-4 * (1.0 + std::abs(gradient[i])));
  }
}

TEST(FieldSurveyTest, ThinningKeepsMeansCountsAndVariances) {
  std::vector<FieldObservation> observations;
  for (int i = 0; i < 4; ++i) observations.push_back({{0.01 * i, 0.0, 0.0}, {1.0 * i, 2.0, 3.0}, 2.0});
  observations.push_back({{0.5, 0.0, 0.0}, {7.0, 7.0, 7.0}, 1.0});
  observations.push_back({{0.5, std::nan(""), 0.0}, {7.0, 7.0, 7.0}, 1.0});
  const auto cells = thin_survey(observations, 0.1);
  ASSERT_EQ(cells.size(), 2U);
  EXPECT_EQ(cells[0].count, 4);
  EXPECT_NEAR(cells[0].position.x(), 0.015, 1e-12);
  EXPECT_NEAR(cells[0].field_ut.x(), 1.5, 1e-12);
  EXPECT_NEAR(cells[0].variance_ut2, 1.0, 1e-12);
  EXPECT_EQ(cells[1].count, 1);
}

TEST(FieldSurveyTest, TooShortASurveyIsAnInputError) {
  EXPECT_THROW(fit_field_kernels({{{0, 0, 0}, {1, 2, 3}, 1.0}}, 0.1, SlidingGprOptions{}), InputError);
}

}  // namespace
}  // namespace lodestone
