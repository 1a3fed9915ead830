#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/magnetometer/field_grid.h"
#include "core/magnetometer/field_tile_cache.h"
#include "core/options.h"

namespace lodestone {

enum class FieldInterpolation { bilinear, bicubic };

constexpr auto enum_names(FieldInterpolation) {
  return EnumNames<FieldInterpolation, 2>{
      {{FieldInterpolation::bilinear, "bilinear"}, {FieldInterpolation::bicubic, "bicubic"}}};
}

/// Least sigma of a map in a comparison with readings, µT: the error of the interpolation between nodes.
inline constexpr double kMapSigmaFloor_ut = 0.2;

/// The field at one point of the map frame.
struct FieldValue {
  Vector3 field_ut = Vector3::Zero();  ///< µT, map axes
  Matrix3 gradient = Matrix3::Zero();  ///< ∂B_i/∂x_j, µT/m; the exact derivative of the interpolation used
  double sigma_ut = 0.0;               ///< posterior one sigma a component, µT
};

/// Errors of a map, besides its nodes' σ.
struct FieldMapErrors {
  double correlation_m = 0.0;              ///< the error's correlation is exp(−distance / correlation_m); 0: unknown
  Vector3 sigma_shares = Vector3::Ones();  ///< sigma of each component over σ, the root mean square over all three
  /// Sigma of the magnetometers' height about the layer, of a map with one layer, metres. Below 0: unknown.
  double height_sigma_m = -1.0;
};

/// The ambient magnetic field on a regular grid, one or several layers, with posterior sigma at each node. Immutable;
/// queries are thread-safe. The map consists of tiles; tiles without field take no memory. A map may keep only some of
/// its tiles in memory and load others on demand, with the same bits. Copies share their tiles.
class MagneticMap {
 public:
  /// A map in memory. `nodes`: layer-major, then row, then column; (B_x, B_y, B_z, σ) in µT. NaN marks a node without
  /// field. `max_sigma_ut`: there is no field where σ exceeds it. Throws std::invalid_argument if sizes disagree, a
  /// side has fewer than two nodes, or heights do not increase.
  MagneticMap(FieldGrid grid, const std::vector<Eigen::Vector4f>& nodes, double max_sigma_ut,
              const FieldMapErrors& errors = {});

  /// A map with up to `max_bytes` of tiles in memory: the last used. Throws as above.
  MagneticMap(FieldGrid grid, std::shared_ptr<const FieldNodes> nodes, double max_sigma_ut, std::size_t max_bytes,
              const FieldMapErrors& errors = {});

  /// The field at `position` (map, metres); empty outside the grid, in a cell with a corner without field, and where σ
  /// is above the limit. Never extrapolates in x, y; below the lowest and above the highest layer, the nearest layer is
  /// used. Between layers the field is linear in z. σ is bilinear for both interpolations. `bicubic` is cubic
  /// convolution (Keys 1981, a = −1/2: Catmull-Rom), C¹ wherever there is field. Throws InputError if a map that is not
  /// wholly in memory can no longer be read.
  std::optional<FieldValue> query(const Vector3& position, FieldInterpolation interpolation) const;

  const FieldGrid& grid() const { return grid_; }

  /// One node (B_x, B_y, B_z, σ); all NaN without field.
  Eigen::Vector4f node(int layer, int row, int column) const;

  /// All nodes in the constructor's order. Builds the array: for small maps.
  std::vector<Eigen::Vector4f> nodes() const;

  /// Calls `visit(node)` for every node with field (also with σ above the limit), tile by tile.
  void for_each_node(const std::function<void(const Eigen::Vector4f& node)>& visit) const;

  double max_sigma_ut() const { return max_sigma_ut_; }

  const FieldMapErrors& errors() const { return errors_; }

  /// The map's tiles: how many were loaded, and their largest size in memory.
  const FieldTileCache& tiles() const { return *tiles_; }

 private:
  FieldGrid grid_;
  double max_sigma_ut_;
  FieldMapErrors errors_;
  std::shared_ptr<const FieldTileCache> tiles_;
};

}  // namespace lodestone
