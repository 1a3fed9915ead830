#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Reads vectors from messages of any type by paths: magnetometer arrays, and IMUs with a magnetometer, have no common
/// message type. The type's definition comes from the log; std_msgs/Float64MultiArray, Float32MultiArray and
/// geometry_msgs/Vector3Stamped are built in.
///
/// A path names a field with components x, y and z (`magnetic_field`, `sensors[2].field`), or the first of three
/// numbers in a list (`data[6]`). The stamp is that of the innermost header along the path, otherwise the record time.
class MessagePaths {
 public:
  struct Vector {
    std::array<double, 3> values{};
    Time stamp = 0;
  };

  /// `source` names the log in messages. Throws InputError if the topic has no definition.
  MessagePaths(std::string source, const TopicInfo& topic);

  /// Adds a path and returns the index of its vector in the output of read(). `key`: the platform key of the path.
  /// Throws InputError with the available fields if the definition has no such path; earlier paths remain valid.
  std::size_t add(const std::string& path, const std::string& key);

  /// The same for the path of a single number, which is the first component of its vector.
  std::size_t add_number(const std::string& path, const std::string& key);

  /// After so many units, the number of a path of add_number() begins anew: 2^bits of an integer; 0: it does not.
  double period(std::size_t vector) const;

  /// Reads one vector per path in one pass. Throws InputError with topic and time if the message contradicts its
  /// definition, or a list is shorter than a path requires.
  void read(const RawMessage& raw, std::vector<Vector>& vectors) const;

  struct Field {
    std::string type, name;
    int count = single;                              ///< elements of a list of fixed size
    static constexpr int single = -1, counted = -2;  ///< not a list; a list that begins with its count
  };
  struct Step {
    std::string name;
    std::uint32_t index = 0;
  };
  /// One requested number.
  struct Target {
    std::vector<Step> steps;
    std::size_t vector = 0, component = 0;
  };

 private:
  void parse(const TopicInfo& topic);
  const Field* field_at(const std::vector<Step>& steps, bool& in_list) const;
  std::string no_such_path(const std::string& path, const std::string& key, const std::string& expected) const;

  std::string source_;
  TopicInfo topic_;
  std::map<std::string, std::vector<Field>> types_;  ///< by ROS 1 name
  std::vector<Target> targets_;                      ///< three per path, one per path of a number
  std::size_t vectors_ = 0;
};

}  // namespace lodestone
