#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/lidar/association.h"
#include "estimators/initialization/field_evidence.h"
#include "estimators/initialization/place_search.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"

namespace lodestone {

/// A pose at which the first scan may have been taken, and what speaks for it.
struct StartCandidate {
  Pose T_map_imu;       ///< at the scan's end
  ScanAgreement lidar;  ///< of what stands above the floor
  FieldEvidence field;
  double log_likelihood = 0.0;  ///< LiDAR and field together
};

/// All of them, best first, and what the scan says if it was taken nowhere on the map.
struct StartCandidates {
  std::vector<StartCandidate> found;
  double nowhere_log_likelihood = 0.0;
  int search_points = 0;  ///< of the scan that stand above the floor
  bool complete = true;   ///< false: the search over the cloud map ended early
};

/// Weighs LiDAR and field for one scan at one pose.
class StartEvidence {
 public:
  /// `field` may be null. Both must outlive this.
  StartEvidence(const SensorSuite& suite, const MagneticMap* field);

  /// `points`: of the scan above the floor, imu frame. `array`: null where there is none.
  void weigh(std::span<const Eigen::Vector3f> points, const ArrayReading* array, const PlaneMap& planes,
             StartCandidate& candidate) const;

  /// The same data of a place that is not on the map: half of what is seen fits by chance, the field is any.
  double nowhere(std::span<const Eigen::Vector3f> points, const ArrayReading* array, const Quaternion& attitude) const;

 private:
  const SensorSuite& suite_;
  const MagneticMap* field_;
  FieldBackground background_;
};

/// The points of a scan that stand above its floor: all floors look alike.
std::vector<Eigen::Vector3f> above_floor(const StartScan& scan);

/// Finds where a scan may have been taken, anywhere on the maps: search over the cloud map by branch and bound, and
/// over the magnetic map; registration of each candidate; the field's correction along what LiDAR does not see;
/// evidence of both.
class StartSearch {
 public:
  /// Builds the pyramids: once a map. `field` may be null. All must outlive this. Throws InputError where the cloud map
  /// shows no floor.
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
