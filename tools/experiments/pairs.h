#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/paired_ratio.h"
#include "tools/experiments/ablation.h"
#include "tools/experiments/results.h"

namespace lodestone::ablation {

/// A variant's run and the baseline's under the same conditions: world, sequence, scenes, LiDAR range, seed.
struct Pair {
  std::string drive;  ///< WORLD-SEQUENCE[-RANGEm][-SCENE]: all of these but the seed
  int seed = 0;
  const reproduce::RunFigures* variant = nullptr;   ///< null where it is not done
  const reproduce::RunFigures* baseline = nullptr;  ///< likewise

  bool both_done() const { return variant != nullptr && baseline != nullptr; }
};

/// What tells the runs of an ablation apart, beside variant and seed. A log's field noise is none of it: it may be what
/// the variants differ in.
std::string drive_name(const reproduce::Run& run);

/// The figure, if it is there and finite.
std::optional<double> figure_of(const reproduce::RunFigures& figures, const std::string& name);

/// Whether the estimator lost track: more than 1 m off at any time, or not at the end of the log.
bool is_lost(const reproduce::RunFigures& figures);

/// Every run of a variant with its counterpart, in the order of the runs.
std::vector<Pair> pairs_of(const Ablation& ablation, const Variant& variant, const reproduce::Results& results);

/// A variant against the baseline. An error over a stretch that ends where track was lost says nothing: ratios are of
/// pairs in which neither lost track. Losing track where the other does not counts among better and worse.
struct Comparison {
  std::size_t pairs = 0;  ///< planned
  std::size_t done = 0;   ///< of these, both runs
  std::size_t lost = 0;   ///< of `done`, by the variant
  std::size_t baseline_lost = 0;
  std::size_t better = 0;  ///< pairs with the smaller figure
  std::size_t worse = 0;
  std::size_t equal = 0;
  std::vector<double> ratios;                ///< variant / baseline, a pair each
  std::optional<RatioEstimate> over_pairs;   ///< nothing where there is no ratio
  std::optional<RatioEstimate> over_drives;  ///< of the drives' geometric means: seeds of one drive are no new drives
  std::map<std::string, std::vector<double>> by_drive;  ///< ratios
};

/// Compares one figure of the pairs that are done. Where it is absent, or not above zero in both, a pair gives no
/// ratio.
Comparison compare_pairs(const std::vector<Pair>& pairs, const std::string& figure);

/// Geometric mean of the variant's figure over the pairs in which it is done and kept track; nothing where there is
/// none.
std::optional<double> geometric_mean(const std::vector<Pair>& pairs, const std::string& figure);

}  // namespace lodestone::ablation
