#pragma once

#include <memory>
#include <optional>

#include "core/lidar/scan_matcher.h"
#include "estimators/baselines/ndt/ndt_filter_options.h"
#include "estimators/baselines/ndt/pose_filter.h"
#include "estimators/factory.h"

namespace lodestone {

/// HDL Localization (Koide et al. 2019): NDT registers the thinned scan, without deskewing, with the cloud map; an
/// unscented Kalman filter predicts the pose with the IMU, and is corrected by the registered pose. Uses neither
/// magnetometers nor wheels. Decisions and parameters: docs/design/056-ndt.md.
class NdtLocalization final : public Estimator {
 public:
  NdtLocalization(EstimatorInput input, std::shared_ptr<ScanMatcher> matcher, NdtFilterOptions options);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink&) override {}
  std::string solver() const override { return "PCL NormalDistributionsTransform"; }

 private:
  void predict(std::span<const ImuSample> imu, Time from, Time to);
  void correct(const LidarScan& scan, Diagnostics& diagnostics);

  EstimatorInput input_;
  std::shared_ptr<ScanMatcher> matcher_;
  NdtFilterOptions options_;
  std::optional<PoseFilter> filter_;  // from the first bundle on
};

}  // namespace lodestone
