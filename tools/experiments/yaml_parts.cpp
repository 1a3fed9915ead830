#include "tools/experiments/yaml_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/nearest_name.h"
#include "frontends/configuration/options.h"
#include "tools/simulate/world_queries.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

void read_drive(const ConfigurationNode& node, std::vector<Drive>& drives) {
  node.refuse_keys_other_than({"world", "sequences", "scene", "map_scenes", "grade"});
  Drive drive;
  const ConfigurationNode& world = node.at("world");
  drive.world = path_beside(world);
  drive.world_name = fs::path(drive.world).stem().string();
  drive.scene = text(node, "scene");
  drive.grade = read_grade(node);
  if (const ConfigurationNode* scenes = node.find("map_scenes")) {
    for (const ConfigurationNode& scene : scenes->elements()) drive.map_scenes.push_back(file_name(scene));
  }
  for (const ConfigurationNode& sequence : node.at("sequences").elements()) {
    drive.sequence = file_name(sequence);
    drives.push_back(drive);
  }
  if (node.at("sequences").elements().empty()) node.at("sequences").fail("expected at least one sequence");
}

}  // namespace

std::string path_beside(const ConfigurationNode& node) {
  return fs::absolute(fs::path(node.file()).parent_path() / node.as_string()).lexically_normal().string();
}

std::string read_grade(const ConfigurationNode& node) {
  const ConfigurationNode* grade = node.find("grade");
  if (grade == nullptr) return {};
  auto known = simulation::RealityGrade::exact;
  options_detail::read_value(*grade, known);
  return grade->as_string();
}

std::string text(const ConfigurationNode& node, const std::string& key, const std::string& otherwise) {
  const ConfigurationNode* child = node.find(key);
  return child != nullptr ? child->as_string() : otherwise;
}

std::vector<std::string> texts(const ConfigurationNode& node, const std::string& key) {
  std::vector<std::string> list;
  if (const ConfigurationNode* child = node.find(key)) {
    for (const ConfigurationNode& element : child->elements()) list.push_back(element.as_string());
  }
  return list;
}

void require_known(const ConfigurationNode& node, const std::string& name, const std::vector<std::string>& known,
                   const std::string& what) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  if (known.empty()) node.fail(fmt::format("there is no {} '{}'", what, name));
  node.fail(fmt::format("there is no {} '{}'{} (known: {})", what, name, suggestion(name, known), join_names(known)));
}

void check_file_name(const ConfigurationNode& node, const std::string& name) {
  const bool good = !name.empty() && name[0] != '.' && std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '-' || letter == '_' || letter == '.';
  });
  if (!good)
    node.fail(fmt::format("'{}' becomes a folder's or file's name: use letters, digits, '-', '_' and '.' alone", name));
}

std::string file_name(const ConfigurationNode& node) {
  const std::string name = node.as_string();
  check_file_name(node, name);
  return name;
}

void read_drives(const ConfigurationNode& node, std::vector<Drive>& drives) {
  for (const ConfigurationNode& drive : node.at("drives").elements()) read_drive(drive, drives);
}

std::vector<double> read_ranges(const ConfigurationNode& node) {
  const ConfigurationNode* ranges = node.find("ranges_m");
  if (ranges == nullptr) return {};
  const std::vector<double> values = ranges->as_doubles();
  for (const double range : values) {
    if (!(range > 0.0)) ranges->fail("a LiDAR range must be above 0 m");
  }
  return values;
}

void check_rows(const ConfigurationNode& node, const Group& group) {
  std::set<std::string> seen;
  for (const std::string& row : row_names(group)) {
    if (!seen.insert(row).second) {
      node.fail(fmt::format("two runs would be called '{}'; rename a world's file or make two groups", row));
    }
  }
}

}  // namespace lodestone::reproduce
