#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/geometry/so3.h"
#include "core/mapping/noise_calibration.h"
#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// The difference of a reading of another drive from a regression of the survey, besides the regression's posterior
/// sigma and white noise: errors of poses, calibration and clocks, which all readings of a drive share over a stretch
/// of its way. Per component the variance is sigma_ut² + position_sigma_m² |∇B|²: where the field changes, an error of
/// position is an error of the field (noisy-input regression, McHutchon & Rasmussen 2011). docs/design/046
struct DriveError {
  Vector3 sigma_ut = Vector3::Zero();
  double position_sigma_m = 0.0;
  /// Rms of each component's errors over the root mean square of the three components' predicted sigmas.
  Vector3 sigma_shares = Vector3::Ones();
  double correlation_m = 0.0;  ///< the errors' correlation is exp(−distance / correlation_m); 0: not estimated
  /// Mean negative log likelihood of an error by a Student distribution, up to a constant; infinite if there are fewer
  /// than enough_held_out_cells.
  double held_out_cost = std::numeric_limits<double>::infinity();

  /// Variance per component, µT², for the components' squared horizontal slopes, (µT/m)².
  Vector3 variance(const Vector3& squared_slope) const {
    return sigma_ut.cwiseAbs2() + position_sigma_m * position_sigma_m * squared_slope;
  }
};

/// A prediction with the squared horizontal slopes of its components, (µT/m)².
struct SlopedPrediction {
  FieldPrediction field;
  Vector3 squared_slope = Vector3::Zero();
};

/// Predictions at `points`, slopes by differences over `step_m` to either side.
std::vector<SlopedPrediction> predict_with_slopes(const WindowedRegression& regression,
                                                  const std::vector<Vector3>& points, double step_m);

/// A held-out cell against the prediction of the other passes.
struct HeldOutCell {
  Vector3 position = Vector3::Zero();
  int block = 0;                            ///< errors are compared within a block only
  Vector3 error_ut = Vector3::Zero();       ///< measured minus predicted
  Vector3 variance_ut2 = Vector3::Zero();   ///< of the prediction and of the cell's white noise
  Vector3 squared_slope = Vector3::Zero();  ///< (µT/m)²
  std::array<bool, 3> well_predicted{};     ///< components that count
};

/// The drive error that explains held-out cells. For each position sigma, sigma_ut per component follows from
/// calibrated_noise; the most likely of these is chosen by a Student distribution, whose heavy tails tolerate large
/// errors near steel. Zero if the predicted variances suffice or if fewer than enough_held_out_cells count; shares and
/// correlation are then not estimated.
DriveError fit_drive_error(const std::vector<HeldOutCell>& cells, double correlation_reach_m);

/// A held-out cell's error over its sigma, one component.
struct NormalizedError {
  Vector3 position;
  int block;
  double value;  ///< its expected square is 1
};

/// The length L for which exp(−distance / L) fits the correlation of the errors within blocks best (least squares over
/// bins of all pairs up to `reach_m` apart); 0 if there are too few pairs.
double error_correlation_length(const std::vector<NormalizedError>& errors, double reach_m);

}  // namespace lodestone
