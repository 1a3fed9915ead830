#pragma once

#include <cstdint>
#include <vector>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// A rectangle of the first map's grid, with the differences of its nodes.
struct DifferencePiece {
  int column = 0;  ///< of its lower left node in the grid
  int row = 0;
  int columns = 0;
  int rows = 0;
  /// Layer, row, column: ΔB = second − first in µT, map axes, and √(σ_first² + σ_second²), of one component; NaN if not
  /// compared.
  std::vector<Eigen::Vector4f> nodes;
  /// Row, column: the layer in which |ΔB| is largest; −1 if none was compared.
  std::vector<std::int16_t> largest_layer;

  const Eigen::Vector4f& at(int layer, int piece_row, int piece_column) const {
    return nodes[(static_cast<std::size_t>(layer) * rows + piece_row) * columns + piece_column];
  }
  /// The largest |ΔB| over the layers at a node, µT; negative if none was compared.
  double change(int piece_row, int piece_column) const;
};

/// Difference between two magnetic maps of one place.
struct MagneticDifference {
  FieldGrid grid;                          ///< the first map's: its nodes are compared
  Vector3 sigma_shares = Vector3::Ones();  ///< sigma of each component over that of the pieces
  std::vector<DifferencePiece> pieces;     ///< only those with compared nodes; row by row from below
  double compared_m2 = 0.0;                ///< area where both have field in a layer
  double only_first_m2 = 0.0;              ///< area where only the first has
  double only_second_m2 = 0.0;
  std::int64_t nodes = 0;  ///< compared, all layers
  double mean_ut = 0.0;    ///< of |ΔB|
  double rms_ut = 0.0;
  double high_ut = 0.0;  ///< 95 % of the nodes lie below
  double largest_ut = 0.0;
  Vector3 largest_at = Vector3::Zero();  ///< map
  /// |ΔB| / √(σ_first² + σ_second²), σ of one component: the root mean square, divided by √3. 1 if the difference is
  /// only due to the maps' own errors, independent and with correct sigmas.
  double normalized_rms = 0.0;
  double share_above_three_sigma = 0.0;  ///< of nodes with |ΔB| > 3 √(σ_first² + σ_second²); 2.9 % by chance alone
};

/// Compares `second` with `first` at the first's nodes, by bicubic interpolation: grids, resolutions and layers may
/// differ. A map of one layer is used at any height. The same bits on any number of threads. If nothing was compared,
/// `nodes` is 0.
MagneticDifference compare_maps(const MagneticMap& first, const MagneticMap& second);

}  // namespace lodestone
