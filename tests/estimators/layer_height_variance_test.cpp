// The variance of the magnetic layer's height in reported covariances.
#include "estimators/layer_height_variance.h"

#include <gtest/gtest.h>

#include <vector>

namespace lodestone {
namespace {

constexpr double kOwn_m2 = 1e-6;

/// Reports each scan as causal estimate, and as smoothed and best one at the end.
class Recorder final : public Estimator {
 public:
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate;
    estimate.time = bundle.scan.end;
    estimate.covariance = kOwn_m2 * Matrix6::Identity();
    estimate.diagnostics.points = static_cast<int>(bundle.scan.points.size());
    sink.causal(estimate);
    estimates_.push_back(estimate);
  }
  void finish(EstimateSink& sink) override {
    for (const Estimate& estimate : estimates_) {
      sink.smoothed(estimate);
      sink.best(estimate);
    }
  }

 private:
  std::vector<Estimate> estimates_;
};

struct Variances final : EstimateSink {
  std::vector<double> height_m2;
  void add(const Estimate& estimate) {
    height_m2.push_back(estimate.covariance(5, 5));
    Matrix6 rest = estimate.covariance;
    rest(5, 5) = kOwn_m2;
    EXPECT_EQ(rest, kOwn_m2 * Matrix6::Identity());
  }
  void causal(const Estimate& estimate) override { add(estimate); }
  void smoothed(const Estimate& estimate) override { add(estimate); }
  void best(const Estimate& estimate) override { add(estimate); }
};

/// Of a scan with points and one without: causal both, then smoothed and best of each.
std::vector<double> variances(double map_height_sigma_m, bool has_cloud) {
  LayerHeightVariance estimator(std::make_unique<Recorder>(), map_height_sigma_m, has_cloud);
  Variances result;
  ScanBundle bundle;
  bundle.scan.points.resize(3);
  estimator.process(bundle, result);
  bundle.scan.points.clear();
  estimator.process(bundle, result);
  estimator.finish(result);
  return result.height_m2;
}

TEST(LayerHeightVariance, IsThatOfTheMapInEachEstimateWithoutCloudMap) {
  EXPECT_EQ(variances(0.01, false), std::vector<double>(6, kOwn_m2 + 0.01 * 0.01));
  EXPECT_EQ(variances(-1.0, false), std::vector<double>(6, kOwn_m2 + kLayerHeightSigma_m * kLayerHeightSigma_m));
}

TEST(LayerHeightVariance, IsInEstimatesOfScansWithoutPointsWithACloudMap) {
  const double both_m2 = kOwn_m2 + 0.01 * 0.01;
  EXPECT_EQ(variances(0.01, true), (std::vector<double>{kOwn_m2, both_m2, kOwn_m2, kOwn_m2, both_m2, both_m2}));
}

}  // namespace
}  // namespace lodestone
