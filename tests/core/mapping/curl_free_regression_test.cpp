#include "core/mapping/curl_free_regression.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <functional>

#include "core/error.h"
#include "core/mapping/field_kernel_fit.h"
#include "core/mapping/magnetic_map_builder.h"
#include "tests/core/mapping/curl_free_fields.h"

namespace lodestone {
namespace {

using testing::RandomPotential;
using testing::survey_lanes;

const CurlFreeKernel kernel{{18.0, -3.0, -42.0}, 10.0, 6.0, 0.6, 0.5, 0.2};

TEST(CurlFreeKernelTest, CovarianceIsTheSecondDerivativeOfThePotentials) {
  const Vector3 scales = kernel.length_scales_m();
  const double potential = kernel.signal_sigma_ut * kernel.length_scale_m;
  const auto covariance_of_potential = [&](const Vector3& d) {
    return potential * potential * std::exp(-0.5 * d.cwiseQuotient(scales).squaredNorm());
  };
  const double h = 1e-4;
  const Vector3 offset(0.3, -0.5, 0.2);
  const Matrix3 found = curl_free_covariance(kernel, offset);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector3 a = h * Vector3::Unit(i), b = h * Vector3::Unit(j);
      const double second = (covariance_of_potential(offset + a + b) - covariance_of_potential(offset + a - b) -
                             covariance_of_potential(offset - a + b) + covariance_of_potential(offset - a - b)) /
                            (4.0 * h * h);
      EXPECT_NEAR(found(i, j), -second, 1e-5 * 36.0);  // the second point enters with the other sign
    }
  }
}

TEST(CurlFreeKernelTest, LikelihoodGradientMatchesDifferences) {
  const RandomPotential field(kernel, 1);
  std::vector<FieldCell> cells = thin_survey(survey_lanes(field, 2.0, 4, 0.3, 1.0, 2), 0.2);
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].position.z() += 0.1 * static_cast<double>(i % 3);
  CurlFreeKernel wrong = kernel;
  wrong.length_scale_m = 0.45;
  wrong.noise_sigma_ut = 0.6;
  Eigen::Matrix<double, 5, 1> gradient;
  log_marginal_likelihood(cells, wrong, &gradient);
  const double step = 1e-5;
  for (int i = 0; i < 5; ++i) {
    const auto moved = [&](double by) {
      CurlFreeKernel other = wrong;
      std::array<double*, 5> parameter{&other.signal_sigma_ut, &other.length_scale_m, &other.vertical_length_scale_m,
                                       &other.noise_sigma_ut, &other.linear_sigma_ut};
      *parameter[static_cast<std::size_t>(i)] *= std::exp(by);
      return log_marginal_likelihood(cells, other);
    };
    EXPECT_NEAR((moved(step) - moved(-step)) / (2.0 * step), gradient[i], 1e-4 * (1.0 + std::abs(gradient[i]))) << i;
  }
}

TEST(CurlFreeKernelTest, FindsTheHyperparametersOfTheFieldItWasDrawnFrom) {
  const RandomPotential field(kernel, 3);
  SlidingGprOptions options;
  options.fit_points = 140;
  const FieldKernelFit fit =
      fit_field_kernels(survey_lanes(field, 16.0, 8, 0.3, 0.5, 4), 0.1, options, FieldMethod::curl_free);
  ASSERT_TRUE(fit.potential);
  EXPECT_NEAR(fit.potential->length_scale_m, 0.6, 0.06);
  EXPECT_NEAR(fit.potential->signal_sigma_ut, 6.0, 1.0);
  EXPECT_NEAR(fit.potential->signal_sigmas_ut().z(), 7.2, 1.4);  // one height determines only the ratio of sigmas
  EXPECT_LT(fit.potential->noise_sigma_ut, 0.3);
}

/// The posterior by brute force: one dense covariance of all readings.
void dense_posterior(const std::vector<FieldCell>& cells, const Vector3& point, Vector3& mean, Vector3& variance) {
  const auto count = static_cast<Eigen::Index>(cells.size());
  const double linear = kernel.linear_sigma_ut * kernel.linear_sigma_ut;
  Eigen::MatrixXd covariance(3 * count, 3 * count);
  Eigen::MatrixXd cross(3 * count, 3);
  Eigen::VectorXd values(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      covariance.block<3, 3>(3 * i, 3 * j) =
          curl_free_covariance(kernel, cells[i].position - cells[j].position) + linear * Matrix3::Identity();
    }
    covariance.diagonal().segment<3>(3 * i).array() +=
        cells[i].variance_ut2 + kernel.noise_sigma_ut * kernel.noise_sigma_ut;
    cross.middleRows<3>(3 * i) = curl_free_covariance(kernel, cells[i].position - point) + linear * Matrix3::Identity();
    values.segment<3>(3 * i) = cells[i].field_ut - kernel.mean_ut;
  }
  const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance);
  mean = kernel.mean_ut + cross.transpose() * cholesky.solve(values);
  const Matrix3 posterior = curl_free_covariance(kernel, Vector3::Zero()) + linear * Matrix3::Identity() -
                            cross.transpose() * cholesky.solve(cross);
  variance = posterior.diagonal();
}

/// Largest errors of mean and sigma against brute force, over points at the cells' height and off it.
Eigen::Vector2d error_of(double domain_margin, double cutoff) {
  const RandomPotential field(kernel, 5);
  std::vector<FieldCell> cells = thin_survey(survey_lanes(field, 1.2, 4, 0.35, 0.5, 6), 0.15);
  SlidingGprOptions options;
  options.margin_length_scales = 2.4;  // all cells are in every window
  options.scale_prior_points = 1e12;
  options.domain_margin_length_scales = domain_margin;
  options.basis_cutoff = cutoff;
  const CurlFreeRegression regression(cells, kernel, options);
  const std::vector<Vector3> points{{0.6, 0.35, 0.4}, {0.7, 0.52, 0.4}, {0.85, 0.6, 0.45}, {0.7, 0.45, 0.6}};
  const std::vector<FieldPrediction> found = regression.predict(points);
  Eigen::Vector2d worst = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector3 mean, variance;
    dense_posterior(cells, points[i], mean, variance);
    worst[0] = std::max(worst[0], (found[i].field_ut - mean).cwiseAbs().maxCoeff());
    worst[1] = std::max(worst[1], (found[i].sigma_ut - variance.cwiseSqrt()).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(CurlFreeRegressionTest, ComesToTheExactPosteriorAsTheBasisGrows) {
  const Eigen::Vector2d plain = error_of(1.5, 5.0);
  const Eigen::Vector2d rich = error_of(2.0, 6.0);
  std::printf("mean and sigma against brute force: defaults %.4f %.4f uT, richer basis %.6f %.6f uT\n", plain[0],
              plain[1], rich[0], rich[1]);
  EXPECT_LT(plain.maxCoeff(), 0.05);  // of a field of 6 µT
  EXPECT_LT(rich[0], 0.3 * plain[0]);
  EXPECT_LT(rich[1], 0.3 * plain[1]);
}

/// ∮ B·dl round a rectangle at a height: Gauss-Legendre, 24 nodes a side, found as eigenvalues (Golub & Welsch 1969).
double circulation(const std::function<Eigen::MatrixX3d(const std::vector<Vector3>&)>& field, const Vector3& corner,
                   const Vector3& first, const Vector3& second) {
  constexpr int nodes = 24;
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(nodes, nodes);
  for (int k = 1; k < nodes; ++k) jacobi(k, k - 1) = jacobi(k - 1, k) = k / std::sqrt(4.0 * k * k - 1.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(jacobi);
  double sum = 0.0;
  const std::array<std::pair<Vector3, Vector3>, 4> sides{
      {{corner, first}, {corner + first, second}, {corner + first + second, -first}, {corner + second, -second}}};
  for (const auto& [begin, along] : sides) {
    std::vector<Vector3> points;
    for (int k = 0; k < nodes; ++k) points.push_back(begin + 0.5 * (1.0 + solver.eigenvalues()[k]) * along);
    const Eigen::MatrixX3d values = field(points);
    for (int k = 0; k < nodes; ++k) {
      const double weight = 2.0 * std::pow(solver.eigenvectors()(0, k), 2);
      sum += 0.5 * weight * values.row(k).dot(along);
    }
  }
  return sum;
}

TEST(CurlFreeRegressionTest, AWindowsFieldHasNoCirculationAndTheBlendNextToNone) {
  const RandomPotential field(kernel, 7);
  const auto cells = thin_survey(survey_lanes(field, 5.0, 9, 0.3, 0.5, 8), 0.1);
  const SlidingGprOptions options;
  const CurlFreeRegression regression(cells, kernel, options);
  KernelParameters component{0.0, 60.0, 6.0, 0.45, 0.2};
  const SlidingGpr plain(cells, {component, component, component}, options);
  const auto window = [&](const WindowedRegression& some) {
    const Eigen::Vector2d place = some.window_coordinates({2.5, 1.2, 0.4});
    return [&some, row = std::llround(place.y()), column = std::llround(place.x())](
               const std::vector<Vector3>& points) { return some.solve_window(row, column, points).mean; };
  };
  const auto blend = [](const WindowedRegression& some) {
    return [&some](const std::vector<Vector3>& points) {
      Eigen::MatrixX3d values(static_cast<Eigen::Index>(points.size()), 3);
      const auto predictions = some.predict(points);
      for (std::size_t i = 0; i < points.size(); ++i)
        values.row(static_cast<Eigen::Index>(i)) = predictions[i].field_ut;
      return values;
    };
  };
  const std::array<std::array<Vector3, 3>, 3> loops{
      {{Vector3(2.2, 0.9, 0.4), Vector3(0.5, 0, 0), Vector3(0, 0.5, 0)},
       {Vector3(2.3, 1.0, 0.3), Vector3(0.4, 0, 0), Vector3(0, 0, 0.3)},
       {Vector3(2.4, 1.0, 0.3), Vector3(0, 0.4, 0), Vector3(0, 0.1, 0.3)}}};
  for (const auto& [corner, first, second] : loops) {
    EXPECT_LT(std::abs(circulation(window(regression), corner, first, second)), 1e-11);  // µT·m, of fields of 40 µT
  }
  const auto& [corner, first, second] = loops[0];
  const double blended = std::abs(circulation(blend(regression), corner, first, second));
  const double components = std::abs(circulation(blend(plain), corner, first, second));
  std::printf("circulation round 0.5 m: blended curl-free %.2e, s-GPR %.2e uT m\n", blended, components);
  EXPECT_GT(components, 1e-3);  // a field of three separate processes has a curl
  EXPECT_LT(blended, 0.2 * components);
}

/// Root mean square error against the field, and the same over sigma, at places among thinned lanes.
struct Score {
  double rms = 0.0;
  double normalized = 0.0;
};

Score score(const WindowedRegression& regression, const RandomPotential& field, double length, double width) {
  std::mt19937_64 generator(9);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1.0p-53; };
  std::vector<Vector3> points;
  for (int i = 0; i < 1500; ++i) points.emplace_back(length * uniform(), width * uniform(), 0.4);
  const auto predictions = regression.predict(points);
  Score result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3 error = predictions[i].field_ut - field(points[i]);
    result.rms += error.squaredNorm();
    result.normalized += error.cwiseQuotient(predictions[i].sigma_ut).squaredNorm();
  }
  result.rms = std::sqrt(result.rms / (3.0 * static_cast<double>(points.size())));
  result.normalized = std::sqrt(result.normalized / (3.0 * static_cast<double>(points.size())));
  return result;
}

TEST(CurlFreeRegressionTest, OnAThinnedSurveyItErrsLessThanComponentsAloneAndItsSigmaIsHonest) {
  const SlidingGprOptions options;
  for (const double spacing : {0.3, 0.6}) {
    Score together, alone;
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      const RandomPotential field(kernel, 20 + seed);
      const int lanes = 1 + static_cast<int>(std::lround(2.4 / spacing));
      const auto observations = survey_lanes(field, 8.0, lanes, spacing, 0.5, 30 + seed);
      for (const FieldMethod method : {FieldMethod::curl_free, FieldMethod::sliding_gpr}) {
        const FieldKernelFit fit = fit_field_kernels(observations, 0.1, options, method);
        const Score one = score(*make_regression(thin_survey(observations, fit.cell_m), fit, options), field, 7.9, 2.4);
        Score& sum = method == FieldMethod::curl_free ? together : alone;
        sum.rms += one.rms * one.rms / 3.0;
        sum.normalized += one.normalized * one.normalized / 3.0;
      }
    }
    std::printf("lanes %.1f m apart: rms error curl-free %.3f uT, s-GPR %.3f uT; over sigma %.2f, %.2f\n", spacing,
                std::sqrt(together.rms), std::sqrt(alone.rms), std::sqrt(together.normalized),
                std::sqrt(alone.normalized));
    EXPECT_LT(together.rms, alone.rms);
    // Blocks of 6 m are held out of a floor of 8 m: sigma is then on the safe side.
    EXPECT_GT(std::sqrt(together.normalized), 0.75);
    EXPECT_LT(std::sqrt(together.normalized), 1.25);
  }
}

TEST(CurlFreeRegressionTest, GivesTheSameBitsOnOneThreadAndOnTwo) {
  const RandomPotential field(kernel, 10);
  const auto cells = thin_survey(survey_lanes(field, 3.0, 5, 0.3, 0.5, 11), 0.15);
  std::vector<Vector3> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(0.03 * i, 0.012 * i, 0.4);
  const CurlFreeRegression regression(cells, kernel, {});
  const auto with_threads = [&](int threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return regression.predict(points);
  };
  const auto one = with_threads(1);
  const auto two = with_threads(2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(one[i].field_ut, two[i].field_ut);
    EXPECT_EQ(one[i].sigma_ut, two[i].sigma_ut);
  }
}

TEST(CurlFreeRegressionTest, AboveTheSurveyItsSigmaIsTheExactOneAndBeyondTheReachThePrior) {
  const RandomPotential field(kernel, 12);
  const auto cells = thin_survey(survey_lanes(field, 3.0, 5, 0.3, 0.5, 13), 0.15);
  SlidingGprOptions options;
  options.scale_prior_points = 1e12;
  const std::vector<Vector3> points{
      {1.5, 0.6, 0.4}, {1.5, 0.6, 0.7}, {1.5, 0.6, 1.1}, {1.5, 0.6, 9.0}, {1.5, 9.0, 0.4}};
  const auto predictions = CurlFreeRegression(cells, kernel, options).predict(points);
  for (std::size_t i = 0; i < 3; ++i) {
    Vector3 mean, variance;
    dense_posterior(cells, points[i], mean, variance);
    const Vector3 ratio = predictions[i].sigma_ut.cwiseQuotient(variance.cwiseSqrt());
    std::printf("%.1f m above the survey: sigma over the exact one %.3f %.3f %.3f\n", points[i].z() - 0.4, ratio.x(),
                ratio.y(), ratio.z());
    EXPECT_GT(ratio.minCoeff(), 0.9);
    EXPECT_LT(ratio.maxCoeff(), 1.1);
  }
  EXPECT_NEAR(predictions[3].sigma_ut.x(), std::hypot(kernel.signal_sigma_ut, kernel.linear_sigma_ut), 1e-9);
  EXPECT_LT((predictions[3].field_ut - kernel.mean_ut).norm(), 1e-9);
  EXPECT_FALSE(predictions[4].supported);
}

TEST(CurlFreeRegressionTest, RefusesASurveyOfManyStoreysWithOneLine) {
  const RandomPotential field(kernel, 14);
  auto cells = thin_survey(survey_lanes(field, 2.0, 3, 0.3, 0.5, 15), 0.2);
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].position.z() += static_cast<double>(i);
  EXPECT_THROW(CurlFreeRegression(cells, kernel, {}).predict({{1.0, 0.3, 0.4}}), InputError);
}

TEST(CurlFreeRegressionTest, BuildsTheSameKindOfMap) {
  const RandomPotential field(kernel, 16);
  MagneticMapOptions options;
  options.method = FieldMethod::curl_free;
  options.regression.fit_points = 100;
  options.heights_m = {0.4, 0.5};
  const MagneticMapResult result = build_magnetic_map(survey_lanes(field, 3.0, 5, 0.3, 0.5, 17), options);
  double squares = 0.0;
  int count = 0;
  for (double x = 0.5; x < 2.5; x += 0.13) {
    for (const double z : {0.4, 0.5}) {
      const auto value = result.map.query({x, 0.7, z}, FieldInterpolation::bicubic);
      ASSERT_TRUE(value) << x;
      squares += (value->field_ut - field({x, 0.7, z})).squaredNorm() / (3.0 * value->sigma_ut * value->sigma_ut);
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 2.0);
  EXPECT_FALSE(result.map.query({1.5, 6.0, 0.4}, FieldInterpolation::bicubic));
}

}  // namespace
}  // namespace lodestone
