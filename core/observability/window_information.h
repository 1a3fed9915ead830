#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/nav_state.h"

namespace lodestone {

using Vector15 = Eigen::Matrix<double, 15, 1>;
using Matrix15 = Eigen::Matrix<double, 15, 15>;
using Matrix15x2 = Eigen::Matrix<double, 15, 2>;

/// One linearized, whitened IMU factor between two neighbouring states of a window: 15 rows; columns in tangent order
/// φ, p, v, b_g, b_a of each state, and the shared gravity.
struct ChainLink {
  Matrix15 by_first = Matrix15::Zero();
  Matrix15 by_second = Matrix15::Zero();
  Matrix15x2 by_gravity = Matrix15x2::Zero();
};

/// The information Λ_k of LiDAR and IMU together about pose k of a window: 6×6, all other variables marginalized
/// (docs/design/009). `pose_information[k]`: LiDAR's about pose k, 6×6, order φ, p; negative directions count as none.
/// `links[k]` joins states k and k+1; one fewer than poses. There is no prior, so gauge freedoms stay free. Elimination
/// is by pivoted QR, which separates unobservable from weakly observable variables without an added ridge.
Matrix6 marginal_pose_information(std::span<const Matrix6> pose_information, std::span<const ChainLink> links,
                                  std::size_t k);

}  // namespace lodestone
