#pragma once

#include <functional>
#include <optional>

#include "core/lidar/association.h"
#include "estimators/health/judged_scan.h"

namespace lodestone {

/// A place beside an estimate where its scan and readings are more likely.
struct NearbyPlace {
  Pose T_map_imu;         ///< in place of the state's pose
  double log_odds = 0.0;  ///< ln p(scan, readings | there) − ln p(… | at the estimate), above 0, tempered as in 024
};

/// The best place from 0.25 to some 2 m beside an estimate. Starts on a grid that fit as well as the estimate are
/// registered, without its covariance and its gates: an estimator that is sure of a wrong place keeps the
/// correspondences that agree with it. `readings`: ln p(readings | pose in place of the state's); empty if there are
/// none. None if no place is more likely. Source: docs/design/072-places-nearby.md.
std::optional<NearbyPlace> find_nearby(const JudgedScan& scan, const NavState& state, const PlaneMap& map,
                                       const SensorSuite& suite, const AssociationOptions& association,
                                       const std::function<double(const Pose&)>& readings);

/// Adds up what the scans of a way say of a place beside the estimate. Scans half a metre apart count as new: an object
/// that was moved is the same error at each of them.
class NearbyCheck {
 public:
  /// `odds`: sum of the log odds that contradicts an estimate.
  explicit NearbyCheck(double odds) : odds_(odds) {}

  /// Whether the scan of this estimate counts as new.
  bool is_due(const Estimate& causal) const;

  /// What find_nearby() found at an estimate.
  void add(const Estimate& causal, const std::optional<NearbyPlace>& found);

  /// Whether another place is much more likely.
  bool contradicts() const { return sum_ > odds_; }

  /// That place at the newest scan that was added, once two scans in succession agree on the way to it.
  std::optional<Pose> better() const;

  /// The place that the newest look found, relative to the estimate in map axes, however likely.
  std::optional<Vector3> way() const { return newest_ ? newest_->way() : std::nullopt; }

  void restart();

 private:
  struct Look {
    Time time = 0;
    Vector3 estimated = Vector3::Zero();
    std::optional<Pose> better;

    std::optional<Vector3> way() const {
      if (!better) return std::nullopt;
      return Vector3(better->position - estimated);
    }
  };

  double odds_;
  double sum_ = 0.0;
  std::optional<Look> newest_;
  bool agree_ = false;  // the newest and the one before it
};

}  // namespace lodestone
