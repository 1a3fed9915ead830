#include "frontends/maps/shifted_magnetic_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "frontends/configuration/configuration_node.h"
#include "frontends/maps/magnetic_map_file.h"

namespace lodestone {
namespace {

constexpr const char* kShifted = "shifted";

double rounded(double value_m) {
  return std::round(value_m * 1e6) * 1e-6 + 0.0;
}

/// The nodes of another map.
class NodesOfMap final : public FieldNodes {
 public:
  explicit NodesOfMap(const MagneticMap& map) : map_(map) {}

  bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override {
    bool any = false;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i, ++nodes) {
        *nodes = map_.node(layer, row + j, column + i);
        any = any || !nodes->hasNaN();
      }
    }
    return any;
  }

 private:
  MagneticMap map_;
};

}  // namespace

void shift_magnetic_map(const std::string& from_yaml, const std::string& to_yaml, const Vector3& shift_m) {
  const MagneticMap map = read_magnetic_map(from_yaml);
  FieldGrid grid = map.grid();
  grid.origin += shift_m.head<2>();
  for (double& height : grid.heights_m) height += shift_m.z();
  // Sums of large numbers are rounded to a micrometre: what is shifted there and back is what it was.
  grid.origin = Eigen::Vector2d(rounded(grid.origin.x()), rounded(grid.origin.y()));
  for (double& height : grid.heights_m) height = rounded(height);
  Provenance provenance;
  const ConfigurationNode node = ConfigurationNode::load(from_yaml);
  if (const ConfigurationNode* lines = node.find("provenance")) {
    for (const std::string& key : lines->keys()) provenance.emplace_back(key, lines->at(key).as_string());
  }
  const std::string text = fmt::format("by {:.6f} {:.6f} {:.6f} m", shift_m.x(), shift_m.y(), shift_m.z());
  const auto before =
      std::find_if(provenance.begin(), provenance.end(), [](const auto& line) { return line.first == kShifted; });
  if (before == provenance.end()) {
    provenance.emplace_back(kShifted, text);
  } else {
    before->second += ", then " + text;
  }
  write_magnetic_map(MagneticMap(grid, std::make_shared<NodesOfMap>(map), map.max_sigma_ut(),
                                 default_magnetic_map_bytes, map.errors()),
                     provenance, to_yaml);
}

}  // namespace lodestone
