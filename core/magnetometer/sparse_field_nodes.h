#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/magnetometer/field_grid.h"

namespace lodestone {

/// Nodes in memory, in squares of which only those with field are there.
class SparseFieldNodes final : public FieldNodes {
 public:
  /// Sets one node of the grid (B_x, B_y, B_z, σ), µT. Not thread-safe.
  void set(int layer, int row, int column, const Eigen::Vector4f& node);

  bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override;

 private:
  static constexpr int side = 32;
  static std::int64_t key(int layer, int row, int column) {
    return (static_cast<std::int64_t>(layer) << 48) + (static_cast<std::int64_t>(row / side) << 24) + column / side;
  }
  std::unordered_map<std::int64_t, std::vector<Eigen::Vector4f>> squares_;
};

}  // namespace lodestone
