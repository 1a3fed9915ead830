#pragma once

#include <optional>

#include "core/imu/scan_motion.h"
#include "core/lidar/plane_map_source.h"
#include "core/magnetometer/field_evidence.h"
#include "estimators/factory.h"
#include "estimators/health/nearby_place.h"

namespace lodestone {

/// How well a scan and its magnetometer readings agree with the maps at one pose.
struct PlaceEvidence {
  double scan_share = 0.0;   ///< of the scan's points above the floor: those where the cloud map is occupied
  double decoy_share = 0.0;  ///< the same at poses where the robot is not: what fits by chance
  int scan_points = 0;       ///< points above the floor that were looked up; 0: too few to judge
  double field_odds = 0.0;   ///< ln p(readings | pose) − ln p(readings | anywhere), tempered as in the initial search
  int field_readings = 0;    ///< readings where the map has field
  Vector3 field_ut = Vector3::Zero();  ///< mean of the array's readings, map axes
  double field_spread_ut = 0.0;        ///< spread of a component over the magnetic map
};

/// How well a scan fits: 1 if all points are on the map, 0 if no more than at places where the robot is not.
double fit_of(const PlaceEvidence& evidence);

/// Whether a place that a search found says more than the running estimate: its scan fits better, and its readings fit
/// if those of the estimate do.
bool outweighs(const PlaceEvidence& found, const PlaceEvidence& estimate);

/// Compares scans and readings with the maps, independently of an estimator's association: a fixed sample of the scan's
/// points, and the newest array reading.
class PlaceJudge {
 public:
  /// `input` must outlive this.
  explicit PlaceJudge(const EstimatorInput& input) : input_(input) {}

  /// `estimate`: at the scan's end. Zeros for what the bundle or the maps do not have.
  PlaceEvidence judge(const ScanBundle& bundle, const Estimate& estimate);

  /// The place beside the estimate that was judged last that its scan and readings prefer, if there is one
  /// (find_nearby).
  std::optional<NearbyPlace> nearby(const ScanBundle& bundle, const Estimate& estimate);

 private:
  void judge_scan(PlaceEvidence& evidence) const;
  bool is_on_grid(const Pose& T_map_imu) const;
  const FieldBackground& background();
  void judge_field(const ScanBundle& bundle, const NavState& state, PlaceEvidence& evidence);

  const EstimatorInput& input_;
  std::optional<JudgedScan> scan_;             // of the estimate that was judged last
  std::optional<FieldBackground> background_;  // of the whole field map, read when first needed
};

}  // namespace lodestone
