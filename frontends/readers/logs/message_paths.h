#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/readers/logs/message_source.h"

namespace lodestone {

/// Vectors in messages of any type, by their paths: arrays of magnetometers, and IMUs that carry a magnetometer, have no
/// common message. The type's fields are those of the definition that the log itself holds; those of
/// std_msgs/Float64MultiArray, Float32MultiArray and geometry_msgs/Vector3Stamped are known without.
///
/// A path names a field with components x, y and z (`magnetic_field`, `sensors[2].field`), or the first of three numbers in
/// a list (`data[6]`). The stamp is that of the innermost header on the way there, else the record time.
class MessagePaths {
 public:
  struct Vector {
    std::array<double, 3> values{};
    Time stamp = 0;
  };

  /// `source` names the log in messages, `keys` where each path was given. Throws InputError where the topic has no
  /// definition, or one without such a path (with the fields that are there).
  MessagePaths(std::string source, const TopicInfo& topic, const std::vector<std::string>& paths,
               const std::vector<std::string>& keys);

  /// One vector a path. Throws InputError, with topic and time, where the message contradicts its definition or a list is
  /// shorter than a path asks for.
  void read(const RawMessage& raw, std::vector<Vector>& vectors) const;

  struct Field {
    std::string type, name;
    int count = single;  ///< elements of a list of fixed size
    static constexpr int single = -1, counted = -2;  ///< no list; a list with its count ahead
  };
  struct Step {
    std::string name;
    std::uint32_t index = 0;
  };
  /// One number wanted.
  struct Target {
    std::vector<Step> steps;
    std::size_t vector = 0, component = 0;
  };

 private:
  void parse(const TopicInfo& topic);
  void add(const std::string& path, const std::string& key);
  const Field* field_at(const std::vector<Step>& steps, bool& in_list) const;

  std::string source_;
  TopicInfo topic_;
  std::map<std::string, std::vector<Field>> types_;  ///< by ROS 1 name
  std::vector<Target> targets_;                      ///< three a path
  std::size_t vectors_ = 0;
};

}  // namespace lodestone
