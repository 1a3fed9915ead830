#pragma once

#include <span>
#include <vector>

#include "estimators/initialization/level_pyramid.h"
#include "estimators/initialization/place_search_options.h"

namespace lodestone {

/// A point of a scan as input of the search.
struct SearchPoint {
  Eigen::Vector2f offset_m = Eigen::Vector2f::Zero();  ///< from the robot, level axes, yaw 0
  std::uint32_t bands = 0;                             ///< possible heights above the floor, one bit each; not 0
};

/// A place on a level.
struct Place {
  int level = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< of the imu, map
  double yaw = 0.0;                                      ///< rad, map
  /// Log-likelihood relative to a random place, as if points were independent: Σ ln P(hit or miss | here) / P(… |
  /// anywhere).
  double score = 0.0;
};

struct PlaceSearchResult {
  std::vector<Place> places;  ///< best first, no two within the same half metre and five degrees
  bool complete = true;       ///< false: the search stopped at options.max_nodes
};

/// Searches the place of a scan on all levels of a map, on a grid of cells and headings, by branch and bound over the
/// pyramids. The result is the optimum of the grid (Hess et al. 2016, with height bits instead of occupancy).
class PlaceSearch {
 public:
  /// `headings`: that the search tries, evenly spread; each degree.
  PlaceSearch(std::vector<SiteLevel> levels, const PlaceSearchOptions& options, int headings = 360);

  static constexpr int depth = 5;                        ///< of the pyramids
  static constexpr int margin_cells = (1 << depth) + 4;  ///< required by levels

  /// The best places, up to 250, with at least 0.6 of the best score. Deterministic for any number of threads.
  PlaceSearchResult best(std::span<const SearchPoint> points) const;

  /// Computes the scores of the given places, at the resolution of the cells.
  void score(std::span<const SearchPoint> points, std::span<Place> places) const;

  /// Upper bound over all places in the block of 2^k cells per side at (column, row) of one level at one heading.
  double bound(std::span<const SearchPoint> points, int level, int k, int column, int row, double yaw) const;

  const std::vector<SiteLevel>& levels() const { return levels_; }

 private:
  std::vector<SiteLevel> levels_;
  std::vector<LevelPyramid> pyramids_;
  std::vector<std::vector<std::uint32_t>> sites_;  ///< non-empty cells of each level; the weights come from them
  PlaceSearchOptions options_;
  int headings_;
};

}  // namespace lodestone
