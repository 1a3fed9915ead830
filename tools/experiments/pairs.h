#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/paired_ratio.h"
#include "tools/experiments/ablation.h"
#include "tools/experiments/results.h"

namespace lodestone::ablation {

/// A variant's run and the baseline's run under the same conditions: world, sequence, scenes, LiDAR range, seed.
struct Pair {
  std::string drive;  ///< WORLD-SEQUENCE[-RANGEm][-SCENE]: all conditions but the seed
  int seed = 0;
  const reproduce::RunFigures* variant = nullptr;   ///< null if it has not finished
  const reproduce::RunFigures* baseline = nullptr;  ///< likewise

  bool both_done() const { return variant != nullptr && baseline != nullptr; }
};

/// Identifies the conditions of a run, without variant and seed. The log's field noise is not included, because
/// variants may differ in it.
std::string drive_name(const reproduce::Run& run);

/// The figure, if it exists and is finite.
std::optional<double> figure_of(const reproduce::RunFigures& figures, const std::string& name);

/// Whether the estimator lost track: more than 1 m off at any time, or no estimate at the end of the log.
bool is_lost(const reproduce::RunFigures& figures);

/// Every run of a variant with the baseline's counterpart, in the order of the runs.
std::vector<Pair> pairs_of(const Ablation& ablation, const Variant& variant, const reproduce::Results& results);

/// A variant compared with the baseline. Ratios use only pairs in which both kept track, because an error before a loss
/// of track is not comparable. A pair in which only one lost track counts as better or worse.
struct Comparison {
  std::size_t pairs = 0;  ///< planned
  std::size_t done = 0;   ///< pairs of which both runs have finished
  std::size_t lost = 0;   ///< of `done`: lost by the variant
  std::size_t baseline_lost = 0;
  std::size_t better = 0;  ///< pairs with the smaller figure
  std::size_t worse = 0;
  std::size_t equal = 0;
  std::vector<double> ratios;                           ///< variant / baseline, one per pair
  std::optional<RatioEstimate> over_pairs;              ///< nothing if there is no ratio
  std::optional<RatioEstimate> over_drives;             ///< of the drives' geometric means: seeds are not independent
  std::map<std::string, std::vector<double>> by_drive;  ///< ratios
};

/// Compares one figure of the finished pairs. A pair gives no ratio if the figure is absent, or not positive in both.
Comparison compare_pairs(const std::vector<Pair>& pairs, const std::string& figure);

/// Geometric mean of the variant's figure over all finished pairs in which it kept track; nothing if there are none.
std::optional<double> geometric_mean(const std::vector<Pair>& pairs, const std::string& figure);

}  // namespace lodestone::ablation
