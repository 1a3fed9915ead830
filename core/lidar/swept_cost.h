#pragma once

#include <span>

#include "core/imu/deskewing.h"
#include "core/lidar/condensed_cost.h"

namespace lodestone {

using Vector19 = Eigen::Matrix<double, 19, 1>;
using Matrix19 = Eigen::Matrix<double, 19, 19>;

/// All point-to-plane residuals of a deskewed scan as one quadratic form in y = [ξ; η]: ξ of the condensed cost, at the pose
/// of the scan's end, and η the rates by which deskewing was wrong (Deskewing::rates). A point taken t before the end has
/// r = aᵀ ξ + t [p × Rᵀn; n]ᵀ η. What the noise of the IMU does between the step's ends, given both, is marginalized: of the
/// gyroscope a bridge, by its first modes of Karhunen and Loève, of the accelerometer a shift.
/// With the pose alone taken into account instead, all of a scan's points would seem to share one turn, where a hundredth
/// of a degree of it comes and goes while the beam goes round: heights were known to 0.2 mm that were 0.8 mm off.
struct SweptCost {
  Matrix19 given_both = Matrix19::Zero();  ///< the moment of y, given the poses at both ends of the step
  Matrix19 given_end = Matrix19::Zero();   ///< where only the scan's end is a variable: the turning rate is marginalized too
};

/// `cost`: condensed from the same correspondences at the same pose.
SweptCost sweep(const CondensedCost& cost, std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                const Deskewing& deskewing);

/// A scan as the window takes it up: what its points say, and what they were deskewed with.
struct CondensedScan {
  CondensedCost cost;
  SweptCost swept;
  Deskewing deskewing;
};

/// The points' ages are those of the correspondences.
CondensedScan condense_scan(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                            const Deskewing& deskewing = {});

}  // namespace lodestone
