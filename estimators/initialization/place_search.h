#pragma once

#include <span>
#include <vector>

#include "estimators/initialization/level_pyramid.h"
#include "estimators/initialization/place_search_options.h"

namespace lodestone {

/// A point of a scan as the search sees it.
struct SearchPoint {
  Eigen::Vector2f offset_m = Eigen::Vector2f::Zero();  ///< from the robot, level axes, yaw 0
  std::uint32_t bands = 0;                             ///< heights above the floor that it may have; not 0
};

/// A place on a level that fits the scan.
struct Place {
  int level = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< of the imu, map
  double yaw = 0.0;                                      ///< rad, map
  /// Log-likelihood against a place at random, as if points were independent: Σ ln P(hit or miss | here) / P(… |
  /// anywhere).
  double score = 0.0;
};

struct PlaceSearchResult {
  std::vector<Place> places;  ///< best first, no two within the same half metre and five degrees
  bool complete = true;       ///< false: it ended at options.max_nodes
};

/// Looks for a scan on all levels of a map at once, on a grid of cells and headings, by branch and bound over the
/// pyramids: the places found are the best of the grid, none is missed (Hess et al. 2016, with bits of height for
/// occupancy).
class PlaceSearch {
 public:
  /// `headings`: that the search tries, evenly spread; each degree.
  PlaceSearch(std::vector<SiteLevel> levels, const PlaceSearchOptions& options, int headings = 360);

  static constexpr int depth = 5;                        ///< of the pyramids
  static constexpr int margin_cells = (1 << depth) + 4;  ///< that levels need

  /// The best places, up to 250, down to 0.6 of the best score. Deterministic on any number of threads.
  PlaceSearchResult best(std::span<const SearchPoint> points) const;

  /// Sets the scores of given places, at the resolution of the cells.
  void score(std::span<const SearchPoint> points, std::span<Place> places) const;

  /// The bound of all places in the block of 2^k cells a side from (column, row) of one level at one heading.
  double bound(std::span<const SearchPoint> points, int level, int k, int column, int row, double yaw) const;

  const std::vector<SiteLevel>& levels() const { return levels_; }

 private:
  std::vector<SiteLevel> levels_;
  std::vector<LevelPyramid> pyramids_;
  std::vector<std::vector<std::uint32_t>> sites_;  ///< cells of each level that hold anything: where weights come from
  PlaceSearchOptions options_;
  int headings_;
};

}  // namespace lodestone
