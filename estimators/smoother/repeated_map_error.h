#pragma once

#include <algorithm>
#include <deque>

#include "core/lidar/map_error_moments.h"

namespace lodestone {

/// The variance of the errors that the cloud map repeats, from the log: scans from places some metres apart are
/// compared (compare_map_errors).
class RepeatedMapError {
 public:
  /// The next scan's, and where it was taken.
  void add(MapError error, const Vector3& position) {
    if (!kept_.empty() && (kept_.back().position - position).norm() < kStep_m) return;
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

  /// As displacements of cubes alone: an error that scans share over some metres, which is estimated.
  double cube_variance_m2() const { return pairs_ == 0 ? kAtFirst_m * kAtFirst_m : moments_.cube_variance_m2(); }

  /// Of the smooth parts: errors over tens of metres, which no estimate can tell from the trajectory.
  const MapErrorVariances& variances_m2() const { return variances_m2_; }

 private:
  /// The smooth parts by what may be unseen: the mean of an error over its variance's estimate, of ν values, has the
  /// square ν / (ν - 2). Places ℓ apart twice are independent.
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

  // Far enough that the beams meet other planes, near enough that the cubes are the same.
  static constexpr double kApart_m = 2.0;
  static constexpr double kStep_m = 0.5;
  static constexpr double kMemory = 400.0;    // pairs that the running mean is of: 200 m
  static constexpr double kAtFirst_m = 0.01;  // before anything is known: a usual survey's

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
