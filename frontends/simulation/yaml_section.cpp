#include "frontends/simulation/yaml_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <numeric>

namespace lodestone::simulation {
namespace {

/// Levenshtein distance, for suggestions.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

}  // namespace

YamlSection::YamlSection(YAML::Node node, std::string where) : node_(std::move(node)), where_(std::move(where)) {
  if (node_.IsDefined() && !node_.IsNull() && !node_.IsMap())
    throw InputError(fmt::format("{}: expected a map of keys, found '{}'", where_, summary(node_)));
}

bool YamlSection::has(const std::string& key) {
  known_.insert(key);
  return node_.IsDefined() && node_.IsMap() && node_[key].IsDefined() && !node_[key].IsNull();
}

YAML::Node YamlSection::required(const std::string& key) {
  if (!has(key)) fail(key, "is missing; it has no default");
  return node_[key];
}

YamlSection YamlSection::section(const std::string& key) {
  return {has(key) ? node_[key] : YAML::Node(YAML::NodeType::Map), name_of(key)};
}

double YamlSection::number(const std::string& key, double fallback) {
  return has(key) ? as<double>(node_[key], key) : fallback;
}
double YamlSection::number(const std::string& key) { return as<double>(required(key), key); }

std::string YamlSection::text(const std::string& key, const std::string& fallback) {
  return has(key) ? as<std::string>(node_[key], key) : fallback;
}

Vector3 YamlSection::vector(const std::string& key, const Vector3& fallback) {
  return has(key) ? vector(key) : fallback;
}
Vector3 YamlSection::vector(const std::string& key) {
  const auto values = numbers(key, 3);
  return {values[0], values[1], values[2]};
}

std::vector<double> YamlSection::numbers(const std::string& key, std::size_t count) {
  const auto values = as<std::vector<double>>(required(key), key);
  if (values.size() != count) fail(key, fmt::format("expected {} numbers, found {}", count, values.size()));
  return values;
}

void YamlSection::finish() {
  if (!node_.IsMap()) return;
  for (const auto& entry : node_) {
    const auto key = entry.first.as<std::string>();
    if (known_.contains(key)) continue;
    const auto nearest = std::min_element(known_.begin(), known_.end(), [&](const auto& a, const auto& b) {
      return edit_distance(key, a) < edit_distance(key, b);
    });
    throw InputError(fmt::format("{}: there is no such key{}", name_of(key),
                                 nearest == known_.end() ? "" : "; did you mean '" + *nearest + "'?"));
  }
}

std::string YamlSection::name_of(const std::string& key) const {
  return where_ + (where_.find(": ") == std::string::npos ? ": " : ".") + key;
}

void YamlSection::fail(const std::string& key, const std::string& problem) const {
  throw InputError(name_of(key) + ": " + problem);
}

std::string YamlSection::summary(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  return node.IsMap() ? "a map" : "nothing";
}

Pose read_pose(YamlSection& section, const std::string& position_key) {
  const Vector3 angles = section.vector("rotation_rpy_deg", Vector3::Zero()) * (std::numbers::pi / 180.0);
  Pose pose;
  pose.position = section.vector(position_key, Vector3::Zero());
  pose.rotation = Eigen::AngleAxisd(angles.z(), Vector3::UnitZ()) * Eigen::AngleAxisd(angles.y(), Vector3::UnitY()) *
                  Eigen::AngleAxisd(angles.x(), Vector3::UnitX());
  return pose;
}

}  // namespace lodestone::simulation
