#pragma once

#include <optional>

#include "core/lidar/condensed_cost.h"
#include "core/observability/degeneracy.h"
#include "estimators/factory.h"
#include "estimators/ieskf/iterated_update.h"
#include "estimators/wheel_watch.h"

namespace lodestone {

/// The paper's filter (MIL-LC), complete: undistortion of points and magnetometer samples, Gauss-Newton magnetic
/// localization per sample, two-step update with H_u and H_g, β, Huber weights on the Mahalanobis distance, R from the
/// spread of the samples, gravity in the state. Order within a scan: docs/design/architecture.md. Without a field map:
/// the LiDAR-inertial filter. With wheels, their velocity is a further update, before the others.
class IteratedFilter final : public Estimator {
 public:
  explicit IteratedFilter(EstimatorInput input);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  bool move(const Pose& T_new_old) override;

 private:
  struct Scan;
  Degeneracy analyse(const Scan& scan) const;
  void update_by_wheels(const ScanBundle& bundle, Diagnostics& diagnostics);
  void update_by_field(const ScanBundle& bundle, const Degeneracy& degeneracy, Diagnostics& diagnostics);
  void update_by_lidar(const Scan& scan, const Degeneracy& degeneracy, Diagnostics& diagnostics);

  EstimatorInput input_;
  AssociationOptions association_;  // with the filter's own map_error_repeats
  WheelWatch wheel_watch_;
  bool started_ = false;
  NavState state_;
  Matrix17 covariance_ = Matrix17::Identity();
};

}  // namespace lodestone
