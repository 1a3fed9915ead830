#pragma once

#include <algorithm>
#include <deque>

#include "core/lidar/map_error_moments.h"

namespace lodestone {

/// Estimates the variance of repeated errors of the cloud map from the log, by comparing scans that are some metres
/// apart (compare_map_errors, docs/design/042-repeated-map-error.md), and from what the user states.
class RepeatedMapError {
 public:
  /// `stated_sigma_m`: of the map's displacement over tens of metres, each axis, as the user states it.
  explicit RepeatedMapError(double stated_sigma_m) {
    stated_m2_[kStatedPart] = stated_sigma_m * stated_sigma_m;
    variances_m2_ = stated_m2_;
  }

  /// Whether a scan at `position` (map) is far enough from the last one.
  bool takes(const Vector3& position) const {
    return kept_.empty() || (kept_.back().position - position).norm() >= kStep_m;
  }

  /// Adds the errors of the next scan, and its position, which it takes.
  void add(MapError error, const Vector3& position) {
    while (kept_.size() > 1 && (kept_[1].position - position).norm() >= kApart_m) kept_.pop_front();
    if (!kept_.empty() && (kept_.front().position - position).norm() >= kApart_m) {
      if (const auto found = compare_map_errors(kept_.front().error, error)) {
        ++pairs_;
        moments_.approach(*found, std::max(1.0 / kMemory, 1.0 / pairs_));
        variances_m2_ = smooth_variances_m2(error);
      }
    }
    kept_.push_back({position, std::move(error)});
  }

  /// Variance of cubes' displacements: an error that scans share over some metres, which is estimated as a state.
  double cube_variance_m2() const { return has_compared() ? moments_.cube_variance_m2() : kAtFirst_m * kAtFirst_m; }

  /// Whether scans have been compared: only then does the log tell anything of the map's error.
  bool has_compared() const { return pairs_ > 0; }

  /// Variances of the smooth parts: errors over tens of metres, which are considered, not estimated.
  const MapErrorVariances& variances_m2() const { return variances_m2_; }

 private:
  /// The smooth parts' variances are estimated from few values, ν. The stated ones count as ν₀ more (a scaled inverse
  /// χ² prior), and an error of variance σ² over an estimate from ν values has the mean square ν / (ν − 2). Places 2 ℓ
  /// apart count as independent.
  MapErrorVariances smooth_variances_m2(const MapError& error) const {
    MapErrorVariances found_m2 = moments_.variances_m2();
    found_m2[0] = 0.0;
    const MapErrorVariances both_m2 = found_m2 + stated_m2_;
    if (!(both_m2.sum() > 0.0)) return both_m2;
    double length_m = 0.0;
    for (int part = 1; part < kMapErrorParts; ++part) {
      length_m += both_m2[part] / both_m2.sum() * map_error_length_m(part);
    }
    const double way_m = kStep_m * std::min<double>(pairs_, kMemory);
    const double values = degrees_of_freedom(error, both_m2) * (1.0 + way_m / (2.0 * length_m));
    return (values * found_m2 + kStatedValues * stated_m2_) / (values + kStatedValues - 2.0);
  }

  // Far enough that beams meet other planes, near enough that cubes are the same.
  static constexpr double kApart_m = 2.0;
  static constexpr double kStep_m = 0.5;
  static constexpr double kMemory = 400.0;    // number of pairs of the running mean: 200 m
  static constexpr double kAtFirst_m = 0.01;  // before anything is known: a typical survey
  static constexpr int kStatedPart = 2;       // with ℓ = 20 m
  // A stated sigma is known to a factor of about 1.5: the relative sigma of a variance from ν₀ values is √(2/ν₀).
  static constexpr double kStatedValues = 4.0;

  struct Kept {
    Vector3 position;
    MapError error;
  };
  std::deque<Kept> kept_;
  MapErrorMoments moments_;
  MapErrorVariances stated_m2_ = MapErrorVariances::Zero();
  MapErrorVariances variances_m2_;
  int pairs_ = 0;
};

}  // namespace lodestone
