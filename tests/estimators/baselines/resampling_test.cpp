#include "estimators/baselines/magnetic_particle/resampling.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "core/random_stream.h"

namespace lodestone {
namespace {

TEST(Resampling, DrawsEachIndexAsOftenAsItsWeightSays) {
  RandomStream random(1, "weights");
  std::vector<double> weights(50);
  double sum = 0.0;
  for (double& weight : weights) sum += weight = std::exp(2.0 * random.normal());
  for (double& weight : weights) weight /= sum;
  std::vector<double> mean(weights.size(), 0.0);
  constexpr int kRepeats = 2000;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<int> drawn(weights.size(), 0);
    for (const std::size_t i : low_variance_draws(weights, 80, random.uniform())) ++drawn[i];
    for (std::size_t i = 0; i < weights.size(); ++i) {
      EXPECT_GE(drawn[i], std::floor(80.0 * weights[i]) - 1e-9) << i;
      EXPECT_LE(drawn[i], std::ceil(80.0 * weights[i]) + 1e-9) << i;
      mean[i] += static_cast<double>(drawn[i]) / kRepeats;
    }
  }
  for (std::size_t i = 0; i < weights.size(); ++i) EXPECT_NEAR(mean[i], 80.0 * weights[i], 0.05) << i;
}

TEST(Resampling, TheEffectiveNumberCountsEqualWeights) {
  EXPECT_DOUBLE_EQ(effective_number(std::vector<double>(7, 1.0 / 7.0)), 7.0);
  EXPECT_DOUBLE_EQ(effective_number(std::vector<double>{0.5, 0.5, 0.0, 0.0}), 2.0);
}

TEST(Resampling, TheKldNumberIsTheQuantileOfChiSquare) {
  for (const std::size_t bins : {3, 10, 100, 2000}) {
    const boost::math::chi_squared distribution(static_cast<double>(bins) - 1.0);
    const double exact = boost::math::quantile(distribution, 0.99) / (2.0 * 0.05);
    EXPECT_NEAR(kld_number(bins, 0.05, 0.99), exact, 0.02 * exact) << bins;
  }
  EXPECT_EQ(kld_number(1, 0.05, 0.99), 1.0);
}

WeightedState state_at(double x, double y, double heading) {
  WeightedState result;
  result.state.T_map_imu = {Quaternion(Eigen::AngleAxisd(heading, Vector3::UnitZ())), {x, y, 0.0}};
  return result;
}

TEST(Resampling, ModesAreParticlesInTouchingBins) {
  std::vector<WeightedState> particles;
  for (int i = 0; i < 10; ++i) particles.push_back(state_at(0.1 * i + 0.05, 0.05, M_PI - 0.01));
  for (int i = 0; i < 10; ++i) particles.push_back(state_at(0.1 * i + 0.05, 0.05, -M_PI + 0.01));  // the same heading
  for (int i = 0; i < 5; ++i) particles.push_back(state_at(0.05, 0.1 * i + 3.05, M_PI - 0.01));    // another place
  for (int i = 0; i < 5; ++i) particles.push_back(state_at(0.05, 0.05, 1.0));                      // another heading
  const ParticleModes modes = find_modes(particles, 0.1, 5.0 * M_PI / 180.0);
  EXPECT_EQ(modes.modes, 3);
  EXPECT_EQ(modes.bins, 20U + 5U + 1U);
  for (std::size_t i = 0; i < particles.size(); ++i) EXPECT_EQ(modes.mode[i], i < 20 ? 0 : (i < 25 ? 1 : 2)) << i;
}

}  // namespace
}  // namespace lodestone
