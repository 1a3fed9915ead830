#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimators/factory.h"
#include "estimators/initialization/start_search.h"

namespace lodestone {

/// Where a log may begin, held against all data that was looked at.
struct StartHypothesis {
  Pose T_map_imu;                      ///< at the first bundle's scan start
  Vector3 velocity = Vector3::Zero();  ///< map axes, m/s, at that time
  double probability = 0.0;            ///< among all hypotheses and "nowhere on the map"
  ScanAgreement lidar;                 ///< of the last scan looked at
  FieldEvidence field;
};

struct FoundStart {
  bool sure = false;
  std::string doubt;                  ///< why not, in a few words; empty where sure
  std::vector<StartHypothesis> best;  ///< up to five, most probable first; empty where nothing fits at all
  double data_s = 0.0;                ///< of the log, that decided
  std::size_t candidates = 0;         ///< places that were looked at closely
};

/// Finds a start anywhere on the map from the first seconds of a log. The first scan with points is searched for over
/// the whole of both maps; what fits about as well as the best is then tracked through the following scans by the
/// filter, with the velocity left open, until one place is surer than search.min_probability or the data ends.
class StartFinder {
 public:
  /// `input`: as for an estimator; its initial pose is not looked at. Builds the search structures: once a map. Throws
  /// InputError where there is no cloud map, or where that shows no floor.
  explicit StartFinder(const EstimatorInput& input);

  /// `bundles`: of the log's beginning, in order of time. Deterministic on any number of threads. Throws InputError
  /// where none of them has a scan.
  FoundStart find(std::span<const ScanBundle> bundles) const;

 private:
  EstimatorInput input_;
  PlaceSearchOptions options_;
  std::unique_ptr<StartSearch> search_;
};

/// The readings of the magnetometers at the end of a bundle's scan: the mean of the last `span_s`. `end`: state there.
std::optional<ArrayReading> reading_at_end(const ScanBundle& bundle, const NavState& end, const SensorSuite& suite,
                                           double span_s);

}  // namespace lodestone
