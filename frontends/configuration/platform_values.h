#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/options.h"

/// Values of a platform file. It has its own structure (lists, poses), but values are parsed and written as those of
/// options. All functions throw InputError, with file and line, for values of the wrong type or out of range.
namespace lodestone::platform_values {

using options_detail::read_value;
using options_detail::write_value;

template <class Value>
void read_if_there(const ConfigurationNode& node, const std::string& key, Value& value) {
  if (const ConfigurationNode* child = node.find(key)) read_value(*child, value);
}

template <class Value>
void read_if_there(const ConfigurationNode& node, const std::string& key, std::optional<Value>& value) {
  value.reset();
  if (node.has(key)) read_value(node.at(key), value.emplace());
}

/// The value of `key`, which must be there.
inline void read_positive(const ConfigurationNode& node, const std::string& key, double& value) {
  read_value(node.at(key), value);
  if (!(value > 0.0) || std::isinf(value)) node.at(key).fail("expected a number above 0");
}

inline void read_topic(const ConfigurationNode& node, std::string& topic) {
  read_value(node.at("topic"), topic);
  if (topic.empty()) node.at("topic").fail("expected a topic, found ''");
}

/// Larger than any offset between clocks; a larger value has the wrong unit or is a stamp.
inline constexpr double kLargestClockOffset_s = 3600.0;

inline void read_clock_offset(const ConfigurationNode& node, const std::string& key, double& offset_s) {
  read_if_there(node, key, offset_s);
  if (!(std::abs(offset_s) <= kLargestClockOffset_s)) {
    node.at(key).fail("expected seconds, at most " + write_value(kLargestClockOffset_s) + " either way");
  }
}

/// Larger than the distance between two sensors of a robot; a larger value has the wrong unit.
inline constexpr double kLargestLeverArm_m = 50.0;

inline Pose read_pose(const ConfigurationNode& node) {
  node.refuse_keys_other_than({"translation_m", "quaternion_xyzw"});
  const std::vector<double> translation = node.at("translation_m").as_doubles(3);
  if (std::any_of(translation.begin(), translation.end(),
                  [](double metres) { return !(std::abs(metres) <= kLargestLeverArm_m); })) {
    node.at("translation_m").fail("expected metres, at most " + write_value(kLargestLeverArm_m) + " either way");
  }
  const std::vector<double> q = node.at("quaternion_xyzw").as_doubles(4);
  Pose pose;
  pose.position = Vector3(translation[0], translation[1], translation[2]);
  pose.rotation = Quaternion(q[3], q[0], q[1], q[2]);
  const double length = pose.rotation.norm();
  if (!(std::abs(length - 1.0) < 1e-3)) {
    node.at("quaternion_xyzw").fail("the quaternion's length is " + write_value(length) + "; expected 1");
  }
  // A quaternion of unit length within double precision keeps its bits.
  if (std::abs(length - 1.0) > 1e-15) pose.rotation.normalize();
  return pose;
}

}  // namespace lodestone::platform_values
