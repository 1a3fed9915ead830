#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimators/factory.h"
#include "estimators/initialization/start_search.h"

namespace lodestone {

/// A candidate of the initial pose, with the evidence of all data used.
struct StartHypothesis {
  Pose T_map_imu;                      ///< at the first bundle's scan start
  Vector3 velocity = Vector3::Zero();  ///< map axes, m/s, at that time
  double probability = 0.0;            ///< among all hypotheses and "nowhere on the map"
  ScanAgreement lidar;                 ///< of the last scan used
  FieldEvidence field;
};

struct FoundStart {
  bool sure = false;
  std::string doubt;                  ///< reason of a missing result, in a few words; empty if certain
  std::vector<StartHypothesis> best;  ///< up to five, most probable first; empty if nothing fits
  double data_s = 0.0;                ///< length of the log that was used
  std::size_t candidates = 0;         ///< number of places that were examined closely
};

/// Finds the initial pose anywhere on the map from the first seconds of a log. The first scan with points is searched
/// over the whole of both maps. The filter then tracks the candidates that fit about as well as the best through the
/// following scans, with unknown velocity, until one has a probability above search.min_probability or the data ends
/// (docs/design/024-initial-pose-search.md).
class StartFinder {
 public:
  /// `input`: as for an estimator; its initial pose is ignored. Builds the search structures, once per map. Throws
  /// InputError if there is no cloud map, or if the cloud map has no floor.
  explicit StartFinder(const EstimatorInput& input);

  /// `bundles`: from the log's begin, in order of time. Deterministic for any number of threads. Throws InputError if
  /// none has a scan with enough points.
  FoundStart find(std::span<const ScanBundle> bundles) const;

  /// The found place, if it is sure. Nothing is tracked where too many places fit the first scan alike. `supposed`:
  /// poses at the first bundle's scan end that compete with what the search finds. Throws as find.
  std::optional<StartHypothesis> find_sure(std::span<const ScanBundle> bundles, std::span<const Pose> supposed) const;

 private:
  FoundStart find(std::span<const ScanBundle> bundles, std::span<const Pose> supposed, bool unsure_too) const;

  EstimatorInput input_;
  PlaceSearchOptions options_;
  std::unique_ptr<StartSearch> search_;
};

/// The input of an estimator that begins at a found pose: sigma 0.5 m along each axis, or that of the options if it is
/// larger.
EstimatorInput begin_at(const StartHypothesis& found, EstimatorInput input);

}  // namespace lodestone
