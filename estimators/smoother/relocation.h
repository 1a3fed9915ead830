#pragma once

#include "estimators/smoother/pose_search.h"

namespace lodestone {

/// One sigma of a position that is adrift, up to which a scan may be registered although no search has confirmed it.
inline constexpr double kMostAdrift_m = 0.5;

/// Searches another pose if scan and readings fit badly. The prior is weighed against the measurements
/// (PoseSearch::find), so that few readings cannot overrule a well-known initial pose (docs/design/024).
class Relocation {
 public:
  /// `input` must outlive this.
  explicit Relocation(const EstimatorInput& input) : input_(input) {}

  /// A better initial pose than the given one, if the first scan and its readings support it: horizontally within
  /// initial.search_m and in heading within 7.5°. `state`: at the given initial pose; `covariance`: of its pose (φ
  /// right, p map).
  std::optional<Pose> better_start(const Keyframe& keyframe, const NavState& state, const Matrix6& covariance);

  /// The pose along directions in which the prediction is too uncertain for a linearization, within three sigmas of
  /// `keyframe.predicted`. Empty if all directions are certain enough, or if no pose fits clearly better. An estimate
  /// that is lost is searched for only once a second, because the search reaches 6 m at most.
  std::optional<Pose> better_place(const Keyframe& keyframe, const NavState& state,
                                   const std::function<Vector3(int)>& bias_ut);

  /// That of find_after_gap, for a keyframe that is adrift: searched for once a second. Above a sigma of kMostAdrift_m,
  /// the search of the next scan must find the same.
  std::optional<Pose> place_after_gap(const Keyframe& keyframe, const NavState& state,
                                      const std::function<Vector3(int)>& bias_ut);

 private:
  FieldBackground background();
  bool waits(Time now) const;

  /// Where a scan after a gap was found, and where it was predicted.
  struct Found {
    Pose T_map_imu;
    Pose predicted;
  };

  const EstimatorInput& input_;
  std::optional<Found> unconfirmed_;
  std::optional<FieldBackground> background_;  // computed from the whole map on first use
  std::optional<Time> searched_;               // last search for a place that is lost or adrift
};

}  // namespace lodestone
