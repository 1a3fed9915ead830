#pragma once

#include "core/checkpoint/serialization.h"
#include "estimators/estimate.h"

// How estimates go into a checkpoint.

namespace lodestone {

template <class Archive>
void serialize(Archive& archive, Diagnostics& diagnostics) {
  auto& [points, correspondences, inlier_share, lidar_rmse_m, lidar_nis, direction_sigma_m, direction_weight, degenerate_directions,
         magnetic_samples, magnetic_rejected, magnetic_off_map, magnetic_set_aside, magnetic_weight, magnetic_shrink,
         magnetic_residual_ut, magnetic_nis, clock_offset_s, clock_sigma_s, iterations, step_ms] = diagnostics;
  archive(points, correspondences, inlier_share, lidar_rmse_m, lidar_nis, direction_sigma_m, direction_weight, degenerate_directions);
  archive(magnetic_samples, magnetic_rejected, magnetic_off_map, magnetic_set_aside, magnetic_weight, magnetic_shrink);
  archive(magnetic_residual_ut, magnetic_nis, clock_offset_s, clock_sigma_s, iterations, step_ms);
}

template <class Archive>
void serialize(Archive& archive, Estimate& estimate) {
  auto& [time, state, covariance, diagnostics, health] = estimate;
  archive(time, state, covariance, diagnostics, health);
}

}  // namespace lodestone
