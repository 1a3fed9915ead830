#pragma once

#include <Eigen/Core>
#include <vector>

namespace lodestone {

/// Layout of the grid. Node (column i, row j) lies at origin + resolution * (i, j): nodes, not cell corners.
struct FieldGrid {
  double resolution_m = 0.1;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< map x, y of node (0, 0)
  int columns = 0;                                   ///< along x
  int rows = 0;                                      ///< along y
  std::vector<double> heights_m;                     ///< map z of each layer, increasing; at least one
};

/// Source of the nodes of a magnetic map, piece by piece: a file, or memory.
class FieldNodes {
 public:
  virtual ~FieldNodes() = default;

  /// Reads the nodes (B_x, B_y, B_z, σ), µT, of a rectangle within the grid, row by row from below, into `nodes`; NaN
  /// marks a node without field. Returns false if none of the nodes has field; `nodes` is then undefined. Thread-safe.
  virtual bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const = 0;
};

}  // namespace lodestone
