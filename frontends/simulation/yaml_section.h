#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/geometry/pose.h"

namespace lodestone::simulation {

/// One map of a YAML file, read strictly: each key that is asked for is ticked off, and `finish` refuses those that nobody
/// asked for, with the nearest right one. Also a visitor of option structs (core/options.h).
class YamlSection {
 public:
  /// `where` names the file and the path of keys so far. An undefined node reads as an empty map: all defaults.
  YamlSection(YAML::Node node, std::string where);

  bool has(const std::string& key);
  /// The node under `key`; throws InputError where it is missing.
  YAML::Node required(const std::string& key);
  /// The sub-map under `key`, empty where missing.
  YamlSection section(const std::string& key);

  double number(const std::string& key, double fallback);
  double number(const std::string& key);  ///< throws InputError where missing
  std::string text(const std::string& key, const std::string& fallback);
  Vector3 vector(const std::string& key, const Vector3& fallback);
  Vector3 vector(const std::string& key);
  std::vector<double> numbers(const std::string& key, std::size_t count);  ///< exactly `count` of them; required

  template <class Value>
  void field(const char* name, Value& value, const char*) {
    if (!has(name)) return;
    if constexpr (std::is_same_v<Value, Vector3>) {
      value = vector(name);
    } else {
      value = as<Value>(node_[name], name);
    }
  }

  /// Throws InputError that names the first unknown key and suggests the nearest known one.
  void finish();

  /// "FILE: path.of.keys.key", for messages.
  std::string name_of(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;

  template <class Value>
  Value as(const YAML::Node& node, const std::string& key) const {
    try {
      return node.as<Value>();
    } catch (const YAML::Exception&) {
      fail(key, "expected " + kind_name<Value>() + ", found '" + summary(node) + "'");
    }
  }

 private:
  template <class Value>
  static std::string kind_name() {
    if constexpr (std::is_same_v<Value, bool>) return "true or false";
    if constexpr (std::is_integral_v<Value>) return "a whole number";
    if constexpr (std::is_floating_point_v<Value>) return "a number";
    if constexpr (std::is_same_v<Value, std::string>) return "a text";
    return "a list of numbers";
  }
  static std::string summary(const YAML::Node& node);

  YAML::Node node_;
  std::string where_;
  std::set<std::string> known_;
};

/// at_m and rotation_rpy_deg (roll, pitch, yaw; R = Rz Ry Rx) of a section, identity where missing.
Pose read_pose(YamlSection& section, const std::string& position_key);

}  // namespace lodestone::simulation
