#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

/// Effect of errors of the planes' normals on a scan's information Σ w (J u)² along given directions u: mean (that of
/// CondensedCost::spurious_information) and variance. After Hatleskog & Alexis, "Probabilistic Degeneracy Detection for
/// Point-to-Plane Error Minimization", RA-L 2024, who treat the points' errors as independent. Here all points of a
/// plane share the errors of its two slopes, because the planes belong to the map.
struct InformationNoise {
  Vector6 mean = Vector6::Zero();
  Vector6 variance = Vector6::Zero();
};

/// `directions`: columns, tangent order φ, p (rad, metres). `T_map_imu`: the linearization point of J. With the errors
/// a, b of a plane's slopes (Gaussian, variances v_a, v_b) the information of the plane's points is Σ w (h + α a + β
/// b)². Its variance follows from the moments of the Gaussian; the contribution of the errors to the measured h is
/// subtracted.
InformationNoise information_noise(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                                   const Matrix6& directions);

}  // namespace lodestone
