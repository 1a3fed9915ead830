#pragma once

#include "estimators/baselines/state_cloud.h"
#include "estimators/factory.h"

namespace lodestone {

/// Kalman update of a cloud by the wheels' samples of a bundle; none if the platform or the bundle has no wheels.
/// `total`: covariance of the cloud as a whole, for the gate of spinning wheels.
void update_by_wheels(const ScanBundle& bundle, const SensorSuite& suite, const Matrix17& total, StateCloud& cloud,
                      Diagnostics& diagnostics);

/// Kalman update of a cloud by the height of a field map with one height: the mean height of the magnetometers, with a
/// sigma of 0.02 m (docs/design/017-height-without-cloud-map.md).
void update_by_height(const SensorSuite& suite, double height_m, StateCloud& cloud);

}  // namespace lodestone
