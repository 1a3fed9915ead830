#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/lidar/association.h"
#include "core/magnetometer/field_evidence.h"
#include "estimators/initialization/place_search.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"

namespace lodestone {

/// A candidate pose of the first scan, with its evidence.
struct StartCandidate {
  Pose T_map_imu;       ///< at the scan's end
  ScanAgreement lidar;  ///< of the points above the floor
  FieldEvidence field;
  double log_likelihood = 0.0;  ///< LiDAR and field together
};

/// All candidates, best first.
struct StartCandidates {
  std::vector<StartCandidate> found;
  bool complete = true;  ///< false: the search over the cloud map stopped early
};

/// Evaluates LiDAR and field likelihood of one scan at one pose.
class StartEvidence {
 public:
  /// `field` may be null. Both must outlive this.
  StartEvidence(const SensorSuite& suite, const MagneticMap* field);

  /// `points`: of the scan above the floor, imu frame. `array`: null if there are no readings.
  void weigh(std::span<const Eigen::Vector3f> points, const ArrayReading* array, const PlaneMap& planes,
             StartCandidate& candidate) const;

  /// The pose with which the readings fit best, near `T_map_imu`, whose `information` (φ right, p map) is of the scan.
  /// None if most readings are off the map, or if there are none.
  std::optional<Pose> moved_by_field(const Pose& T_map_imu, const Matrix6& information,
                                     const ArrayReading* array) const;

  /// Log-likelihood of the same data at a place off the map, where the field is the background's.
  double nowhere(std::span<const Eigen::Vector3f> points, const ArrayReading* array, const Quaternion& attitude) const;

 private:
  const SensorSuite& suite_;
  const MagneticMap* field_;
  FieldBackground background_;
};

/// The points of a scan above its floor, since all floors look alike.
std::vector<Eigen::Vector3f> above_floor(const StartScan& scan);

/// Finds candidate poses of a scan anywhere on the maps: branch and bound over the cloud map, search over the magnetic
/// map, registration of each candidate, correction by the field along directions that LiDAR does not observe, and
/// evaluation of both likelihoods.
class StartSearch {
 public:
  /// Builds the pyramids, once per map. `field` may be null. All must outlive this. Throws InputError if the cloud map
  /// has no floor.
  StartSearch(const PlaneMapSource& planes, const MagneticMap* field, const SensorSuite& suite,
              const AssociationOptions& association, const PlaceSearchOptions& options);

  StartCandidates find(const StartScan& scan, const ArrayReading* array) const;

  const StartEvidence& evidence() const { return evidence_; }
  const PlaceSearch& places() const { return search_; }

 private:
  Pose pose_of(const Place& place, const Quaternion& attitude, double height_m) const;
  const PlaneMapSource& planes_;
  const MagneticMap* field_;
  const SensorSuite& suite_;
  AssociationOptions association_;
  PlaceSearch search_;
  StartEvidence evidence_;
};

}  // namespace lodestone
