#pragma once

#include <span>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"

namespace lodestone {

/// What errors of the planes' normals do to a scan's information Σ w (J u)² along given directions u: their mean (that
/// of CondensedCost::spurious_information) and variance. After Hatleskog & Alexis, "Probabilistic Degeneracy Detection
/// for Point-to-Plane Error Minimization", RA-L 2024, who take the points' errors as independent; here all points of a
/// plane share its two slopes' errors, for planes are the map's.
struct InformationNoise {
  Vector6 mean = Vector6::Zero();
  Vector6 variance = Vector6::Zero();
};

/// `directions`: columns, tangent order φ, p (rad, metres). `T_map_imu`: where J is taken. With the slopes' errors a, b
/// of a plane (normal, variances v_a, v_b) the information of its points is Σ w (h + α a + β b)²; its variance follows
/// from the moments of the normal distribution, the share that the errors have in the h that is seen taken off.
InformationNoise information_noise(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                                   const Matrix6& directions);

}  // namespace lodestone
