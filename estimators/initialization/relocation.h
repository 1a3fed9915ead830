#pragma once

#include "estimators/initialization/pose_search.h"

namespace lodestone {

/// Looks for another pose where scan and readings fit badly: the prior and what is measured are weighed against each
/// other (PoseSearch::find), so that few readings do not outvote a start that is known well.
class Relocation {
 public:
  /// `input` must outlive this.
  explicit Relocation(const EstimatorInput& input) : input_(input) {}

  /// A better start than the given one, where the first scan and its readings say so: horizontally within
  /// initial.search_m and in heading within initial.search_deg. `state`: that of the given start; `covariance`: of its
  /// pose (φ right, p map).
  std::optional<Pose> better_start(const Keyframe& keyframe, const NavState& state, const Matrix6& covariance);

  /// Where the robot is along directions of which the prediction knows too little for a linearization: within three
  /// sigmas of `keyframe.predicted`. Nothing where all are known well enough, or where nothing fits clearly better.
  std::optional<Pose> better_place(const Keyframe& keyframe, const NavState& state,
                                   const std::function<Vector3(int)>& bias_ut);

 private:
  FieldBackground background();

  const EstimatorInput& input_;
  std::optional<FieldBackground> background_;  // read from the whole map once it is needed
};

}  // namespace lodestone
