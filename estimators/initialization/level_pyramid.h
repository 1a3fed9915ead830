#pragma once

#include <vector>

#include "estimators/initialization/site_level.h"

namespace lodestone {

/// A level at ever coarser resolution: what any of a block of cells holds. A scan shifted to every cell of a block
/// meets at most what the block's windows hold: an upper bound of all their scores at once. Sources: Olson 2009, Hess
/// et al. 2016.
class LevelPyramid {
 public:
  /// `depth`: the coarsest blocks are 2^depth cells a side. The level's content must keep 2^depth cells from its edges,
  /// so that a window that begins outside of the grid holds nothing.
  LevelPyramid(const SiteLevel& level, int depth);

  int depth() const { return static_cast<int>(layers_.size()) - 1; }

  /// Bits of all cells of [column, column + 2^k) × [row, row + 2^k) together; for k > 2 also of less than a quarter of
  /// a block beyond. For k = 0 exactly those of the cell.
  std::uint32_t window(int k, int column, int row) const {
    const Layer& layer = layers_[static_cast<std::size_t>(k)];
    const int x = column >> layer.shift;
    const int y = row >> layer.shift;
    if (x < 0 || y < 0 || x >= layer.columns || y >= layer.rows) return 0;
    return layer
        .bits[static_cast<std::size_t>(y) * static_cast<std::size_t>(layer.columns) + static_cast<std::size_t>(x)];
  }

 private:
  struct Layer {
    int shift = 0;  ///< windows begin at every 2^shift cells: coarse windows need not be kept for every cell
    int columns = 0;
    int rows = 0;
    std::vector<std::uint32_t> bits;
  };
  std::vector<Layer> layers_;
};

}  // namespace lodestone
