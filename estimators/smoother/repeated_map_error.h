#pragma once

#include <algorithm>
#include <deque>

#include "core/lidar/map_error_moments.h"

namespace lodestone {

/// Estimates the variance of repeated errors of the cloud map from the log, by comparing scans that are some metres
/// apart (compare_map_errors, docs/design/042-repeated-map-error.md).
class RepeatedMapError {
 public:
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
        variances_m2_ = widened(moments_.variances_m2(), error);
      }
    }
    kept_.push_back({position, std::move(error)});
  }

  /// Variance of cubes' displacements: an error that scans share over some metres, which is estimated as a state.
  double cube_variance_m2() const { return pairs_ == 0 ? kAtFirst_m * kAtFirst_m : moments_.cube_variance_m2(); }

  /// Variances of the smooth parts: errors over tens of metres, which are considered, not estimated.
  const MapErrorVariances& variances_m2() const { return variances_m2_; }

 private:
  /// The smooth parts' variances are estimated from few values. An error of variance σ² over an estimate from ν values
  /// has the mean square ν / (ν − 2). Places 2 ℓ apart count as independent.
  MapErrorVariances widened(MapErrorVariances variances_m2, const MapError& error) const {
    constexpr double kFewest = 3.0;
    double weighed_m = 0.0;
    for (int part = 1; part < kMapErrorParts; ++part) weighed_m += variances_m2[part] * map_error_length_m(part);
    if (!(weighed_m > 0.0)) return variances_m2;
    const double length_m = weighed_m / variances_m2.tail<kMapErrorParts - 1>().sum();
    const double values = degrees_of_freedom(error, variances_m2) * (1.0 + kStep_m * pairs_ / (2.0 * length_m));
    const double counted = std::max(kFewest, values);
    variances_m2.tail<kMapErrorParts - 1>() *= counted / (counted - 2.0);
    return variances_m2;
  }

  // Far enough that beams meet other planes, near enough that cubes are the same.
  static constexpr double kApart_m = 2.0;
  static constexpr double kStep_m = 0.5;
  static constexpr double kMemory = 400.0;    // number of pairs of the running mean: 200 m
  static constexpr double kAtFirst_m = 0.01;  // before anything is known: a typical survey

  struct Kept {
    Vector3 position;
    MapError error;
  };
  std::deque<Kept> kept_;
  MapErrorMoments moments_;
  MapErrorVariances variances_m2_ = MapErrorVariances::Zero();
  int pairs_ = 0;
};

}  // namespace lodestone
