#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "frontends/messages/known_types.h"
#include "frontends/messages/result_messages.h"

namespace lodestone {
namespace {

/// Fields of each type, as in ROS 2's .msg files. Types of fields have their package, so that names are unambiguous.
const std::map<std::string, std::string>& result_fields() {
  static const std::map<std::string, std::string> fields{
      {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
      {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
      {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
      {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
      {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
      {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
      {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
      {"geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
      {"geometry_msgs/TransformStamped",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
      {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
      {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
      {"nav_msgs/Odometry",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
       "geometry_msgs/TwistWithCovariance twist\n"},
      {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
      {"diagnostic_msgs/DiagnosticStatus",
       "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
       "string hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
      {"diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"}};
  return fields;
}

/// Appends the types of the fields and their dependencies, each type once.
void collect_types(const std::string& fields, std::vector<std::string>& types) {
  std::istringstream lines(fields);
  for (std::string line; std::getline(lines, line);) {
    const std::string type = line.substr(0, line.find_first_of(" ["));
    if (type.find('/') == std::string::npos || std::find(types.begin(), types.end(), type) != types.end()) continue;
    types.push_back(type);
    collect_types(result_fields().at(type), types);
  }
}

/// The definition of a type with its dependencies, in the format of ROS 2's recorders (ros2msg).
std::string result_definition(const std::string& type) {
  if (message_type(type) == MessageType::point_cloud) return ros2_definition(MessageType::point_cloud);
  const auto found = result_fields().find(type);
  if (found == result_fields().end()) throw std::invalid_argument("result_definition: unknown type " + type);
  std::string text = found->second;
  std::vector<std::string> types;
  collect_types(found->second, types);
  for (const std::string& name : types) {
    text.append(80, '=').append("\nMSG: ").append(name).append("\n").append(result_fields().at(name));
  }
  return text;
}

}  // namespace

TopicInfo result_topic(const std::string& name, const std::string& type) {
  TopicInfo topic;
  topic.name = name;
  topic.type = type;
  topic.encoding = Encoding::cdr;
  topic.definition = result_definition(type);
  topic.definition_encoding = "ros2msg";
  return topic;
}

}  // namespace lodestone
