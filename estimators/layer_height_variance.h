#pragma once

#include <memory>
#include <utility>

#include "estimators/estimator.h"
#include "estimators/layer_height.h"

namespace lodestone {

/// Decorates an estimator on a field map with one layer. Without a cloud map, or during an outage of LiDAR, the
/// estimator constrains the height to the layer's. The error of the layer's height is common to many scans; its
/// variance is added to the reported covariance (docs/design/017-height-without-cloud-map.md).
class LayerHeightVariance final : public Estimator {
 public:
  /// `map_height_sigma_m`: of the map; below 0: unknown. `has_cloud`: only estimates of scans without points are meant.
  LayerHeightVariance(std::unique_ptr<Estimator> estimator, double map_height_sigma_m, bool has_cloud)
      : estimator_(std::move(estimator)),
        sigma_m_(map_height_sigma_m < 0.0 ? kLayerHeightSigma_m : map_height_sigma_m),
        has_cloud_(has_cloud) {}

  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    WideningSink widening(sink, sigma_m_, has_cloud_);
    estimator_->process(bundle, widening);
  }

  void process_in_place(ScanBundle& bundle, EstimateSink& sink) override {
    WideningSink widening(sink, sigma_m_, has_cloud_);
    estimator_->process_in_place(bundle, widening);
  }

  void finish(EstimateSink& sink) override {
    WideningSink widening(sink, sigma_m_, has_cloud_);
    estimator_->finish(widening);
  }

  bool move(const Pose& T_new_old) override { return estimator_->move(T_new_old); }
  std::string solver() const override { return estimator_->solver(); }
  const CalibrationEstimate* calibration() const override { return estimator_->calibration(); }

 private:
  class WideningSink final : public EstimateSink {
   public:
    WideningSink(EstimateSink& next, double sigma_m, bool has_cloud)
        : next_(next), variance_m2_(sigma_m * sigma_m), has_cloud_(has_cloud) {}
    void causal(const Estimate& estimate) override { next_.causal(widened(estimate)); }
    void best(const Estimate& estimate) override { next_.best(widened(estimate)); }
    void smoothed(const Estimate& estimate) override { next_.smoothed(widened(estimate)); }

   private:
    Estimate widened(const Estimate& estimate) const {
      Estimate result = estimate;
      if (!has_cloud_ || estimate.diagnostics.points == 0) result.covariance(5, 5) += variance_m2_;
      return result;
    }

    EstimateSink& next_;
    double variance_m2_;
    bool has_cloud_;
  };

  std::unique_ptr<Estimator> estimator_;
  double sigma_m_;
  bool has_cloud_;
};

}  // namespace lodestone
