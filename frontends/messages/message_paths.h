#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// Vectors in messages of any type, by their paths: arrays of magnetometers, and IMUs that carry a magnetometer, have
/// no common message. The type's fields are those of the definition that the log itself holds; those of
/// std_msgs/Float64MultiArray, Float32MultiArray and geometry_msgs/Vector3Stamped are known without.
///
/// A path names a field with components x, y and z (`magnetic_field`, `sensors[2].field`), or the first of three
/// numbers in a list (`data[6]`). The stamp is that of the innermost header on the way there, else the record time.
class MessagePaths {
 public:
  struct Vector {
    std::array<double, 3> values{};
    Time stamp = 0;
  };

  /// `source` names the log in messages. Throws InputError where the topic has no definition.
  MessagePaths(std::string source, const TopicInfo& topic);

  /// The place of the vector at `path` in what read() gives. `key` is where the path was given. Throws InputError where
  /// the definition has no such path (with the fields that are there); paths that were added before are read all the
  /// same.
  std::size_t add(const std::string& path, const std::string& key);

  /// One vector a path, all in one walk through the message. Throws InputError, with topic and time, where the message
  /// contradicts its definition or a list is shorter than a path asks for.
  void read(const RawMessage& raw, std::vector<Vector>& vectors) const;

  struct Field {
    std::string type, name;
    int count = single;                              ///< elements of a list of fixed size
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
  const Field* field_at(const std::vector<Step>& steps, bool& in_list) const;

  std::string source_;
  TopicInfo topic_;
  std::map<std::string, std::vector<Field>> types_;  ///< by ROS 1 name
  std::vector<Target> targets_;                      ///< three a path
  std::size_t vectors_ = 0;
};

}  // namespace lodestone
