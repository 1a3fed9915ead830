#pragma once

#include <utility>
#include <vector>

#include "core/evaluation/association.h"

namespace lodestone {

/// Distance between estimated and true position of every pair, metres. The rmse of these is the ATE.
std::vector<double> translation_errors(const PosePairs& pairs);

/// Angle of the rotation between estimate and ground truth of every pair, radians, 0 to π.
std::vector<double> angle_errors(const PosePairs& pairs);

/// Heading error of every pair, radians, −π to π: the rotation about the map's z axis (the twist about z of
/// R_estimate R_truthᵀ). It is defined for any tilt of the robot.
std::vector<double> heading_errors(const PosePairs& pairs);

/// Two indices into PosePairs, the earlier first.
using IndexPair = std::pair<std::size_t, std::size_t>;

/// Pairs of poses `step` poses apart, for relative errors. Without `all`, the segments are consecutive; with `all`, a
/// segment begins at every pose. Source: evo 1.36.5, filters.filter_pairs_by_index. Throws std::invalid_argument if
/// the step is 0.
std::vector<IndexPair> segments_by_count(std::size_t pose_count, std::size_t step, bool all);

/// For every pose, the later pose whose distance along the estimated path is nearest to `distance` (metres), if it is
/// within `relative_tolerance` of it. Source: evo 1.36.5, filters.filter_pairs_by_path with all pairs.
std::vector<IndexPair> segments_by_distance(const PosePairs& pairs, double distance, double relative_tolerance = 0.1);

/// The relative error of every segment: (Q_i⁻¹ Q_j)⁻¹ (P_i⁻¹ P_j), with Q the ground truth and P the estimate.
/// Source: Sturm et al., IROS 2012, eq. (2).
std::vector<Pose> relative_errors(const PosePairs& pairs, const std::vector<IndexPair>& segments);

/// Length of the translation of every error pose, metres.
std::vector<double> translations_of(const std::vector<Pose>& errors);

/// Angle of the rotation of every error pose, radians.
std::vector<double> angles_of(const std::vector<Pose>& errors);

}  // namespace lodestone
