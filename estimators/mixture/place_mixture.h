#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/imu/white_noise.h"
#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/field_evidence.h"
#include "estimators/factory.h"
#include "estimators/mixture/place_component.h"

namespace lodestone {

/// Where a robot may be on a field map, as a mixture of Gaussians: the Gaussian sum filter (Sorenson and Alspach 1971).
/// Each component is an extended Kalman filter with IMU, wheels and magnetometers. A component that is wider than the
/// field map is linear is split (Huber 2011), so that a mixture follows all places that fit the readings; components
/// that meet are merged. docs/design/060
class PlaceMixture {
 public:
  /// `input` must have a field map and magnetometers, and must outlive this. Starts at its initial pose.
  explicit PlaceMixture(const EstimatorInput& input);

  /// One scan: prediction, height of the map's layer, wheels, readings.
  void process(const ScanBundle& bundle);

  /// After the newest scan, the heaviest first. The weights' sum is 1.
  const std::vector<PlaceComponent>& components() const { return components_; }

  /// As Diagnostics::wheel_weight, of the newest scan.
  double wheel_weight() const { return wheel_weight_; }

  /// The IMU of the newest scan; none if there was none.
  const std::optional<Preintegration>& increment() const { return increment_; }

 private:
  void predict(const ScanBundle& bundle);
  void split();
  void update_height(PlaceComponent& component) const;
  void update_wheels(const ScanBundle& bundle);
  void doubt_offsets(const ArrayReading& array);
  void update(const ArrayReading& array, double spacing_m);
  double information_share(const ArrayReading& array, double spacing_m) const;
  void reduce();

  const EstimatorInput& input_;
  FieldBackground background_;
  double correlation_m_;
  double crowding_;  ///< number of magnetometers that share a map error, mean over the array
  ImuWhiteNoise imu_white_noise_;
  std::vector<PlaceComponent> components_;
  std::optional<Preintegration> increment_;
  double wheel_weight_ = -1.0;
  bool has_readings_ = false;
};

}  // namespace lodestone
