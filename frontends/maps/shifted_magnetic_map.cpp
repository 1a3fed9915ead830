#include "frontends/maps/shifted_magnetic_map.h"

#include <fmt/format.h>

#include <algorithm>

#include "frontends/configuration/configuration_node.h"
#include "frontends/maps/magnetic_map_file.h"

namespace lodestone {
namespace {

constexpr const char* kShifted = "shifted";

}  // namespace

void shift_magnetic_map(const std::string& from_yaml, const std::string& to_yaml, const Vector3& shift_m) {
  const MagneticMap map = read_magnetic_map(from_yaml, default_magnetic_map_bytes, -shift_m);
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
  write_magnetic_map(map, provenance, to_yaml);
}

}  // namespace lodestone
