#pragma once

#include <vector>

#include "estimators/initialization/site_level.h"

namespace lodestone {

/// A level at increasingly coarse resolution: the union of the bits of each block of cells. If a scan is shifted to
/// every cell of a block, its hits are among the bits of the block's windows, which gives an upper bound of all scores.
/// Sources: Olson 2009, Hess et al. 2016.
class LevelPyramid {
 public:
  /// `depth`: the coarsest blocks have 2^depth cells per side. The level's content must be at least 2^depth cells away
  /// from its edges, so that windows that begin outside of the grid are empty.
  LevelPyramid(const SiteLevel& level, int depth);

  int depth() const { return static_cast<int>(layers_.size()) - 1; }

  /// Union of the bits of all cells of [column, column + 2^k) × [row, row + 2^k); for k > 2 also of up to a quarter of
  /// a block beyond. For k = 0 exactly the cell's bits.
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
    int shift = 0;  ///< windows begin at every 2^shift cells, since coarse windows are not needed at every cell
    int columns = 0;
    int rows = 0;
    std::vector<std::uint32_t> bits;
  };
  std::vector<Layer> layers_;
};

}  // namespace lodestone
