#include "frontends/messages/known_types.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

namespace lodestone {
namespace {

struct KnownType {
  MessageType type;
  const char* name;
  const char* ros1_md5;
};

constexpr KnownType kKnownTypes[] = {
    {MessageType::point_cloud, "sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181"},
    {MessageType::livox, "livox_ros_driver2/CustomMsg", "e4d6829bdfe657cb6c21a746c86b21a6"},
    {MessageType::imu, "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2"},
    {MessageType::magnetic_field, "sensor_msgs/MagneticField", "2f3b0b43eed0c9501de0fa3ff89a45aa"},
    {MessageType::odometry, "nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7"}};

const KnownType* find_known(MessageType type) {
  const auto* found = std::find_if(std::begin(kKnownTypes), std::end(kKnownTypes),
                                   [type](const KnownType& known) { return known.type == type; });
  return found == std::end(kKnownTypes) ? nullptr : found;
}

/// ROS 1 and ROS 2 differ in the header's fields and in defaults, which ROS 1's definitions do not have.
enum class Ros { one, two };

constexpr std::string_view kHeaderField = "std_msgs/Header header\n";

/// Fields of each type, as in ROS 2's .msg files. Types of fields have their package, so that names are unambiguous.
const std::map<std::string, std::string>& ros2_fields() {
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
      {"diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
      {"geometry_msgs/Vector3Stamped", "std_msgs/Header header\ngeometry_msgs/Vector3 vector\n"},
      {"std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n"},
      {"std_msgs/MultiArrayLayout", "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n"},
      {"std_msgs/Float32MultiArray", "std_msgs/MultiArrayLayout layout\nfloat32[] data\n"},
      {"std_msgs/Float64MultiArray", "std_msgs/MultiArrayLayout layout\nfloat64[] data\n"},
      {"sensor_msgs/JointState",
       "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"},
      {"sensor_msgs/PointField",
       "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
       "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
      {"sensor_msgs/PointCloud2",
       "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n"
       "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
      {"livox_ros_driver2/CustomPoint",
       "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"},
      {"livox_ros_driver2/CustomMsg",
       "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
       "livox_ros_driver2/CustomPoint[] points\n"},
      {"sensor_msgs/Imu",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
       "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
       "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
      {"sensor_msgs/MagneticField",
       "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n"}};
  return fields;
}

std::string fields_of(const std::string& type, Ros ros) {
  if (ros == Ros::one && type == "std_msgs/Header") return "uint32 seq\ntime stamp\nstring frame_id\n";
  if (ros == Ros::one && type == "geometry_msgs/Quaternion") return "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
  return ros2_fields().at(type);
}

/// Appends the types of the fields and their dependencies, each type once.
void collect_types(std::string_view fields, Ros ros, std::vector<std::string>& types) {
  std::istringstream lines{std::string(fields)};
  for (std::string line; std::getline(lines, line);) {
    const std::string type = line.substr(0, line.find_first_of(" ["));
    if (type.find('/') == std::string::npos || std::find(types.begin(), types.end(), type) != types.end()) continue;
    types.push_back(type);
    collect_types(fields_of(type, ros), ros, types);
  }
}

/// Definitions of a type's fields and of `types`, in the format of the recorders.
std::string joined_definitions(std::string text, const std::vector<std::string>& types, Ros ros) {
  for (const std::string& type : types) {
    text.append(80, '=').append("\nMSG: ").append(type).append("\n").append(fields_of(type, ros));
  }
  return text;
}

std::string definition_of(MessageType type, Ros ros) {
  const KnownType* known = find_known(type);
  if (known == nullptr) return {};
  const std::string fields = fields_of(known->name, ros);  // begin with the header, whose definition comes last
  std::vector<std::string> types;
  collect_types(std::string_view(fields).substr(kHeaderField.size()), ros, types);
  collect_types(kHeaderField, ros, types);
  return joined_definitions(fields, types, ros);
}

}  // namespace

MessageType message_type(const std::string& type) {
  if (type == "livox_ros_driver/CustomMsg") return MessageType::livox;
  for (const KnownType& known : kKnownTypes) {
    if (type == known.name) return known.type;
  }
  return MessageType::other;
}

std::string expected_md5(MessageType type) {
  const KnownType* known = find_known(type);
  return known == nullptr ? "" : known->ros1_md5;
}

std::string ros1_definition(MessageType type) {
  return definition_of(type, Ros::one);
}

std::string ros2_definition(MessageType type) {
  return definition_of(type, Ros::two);
}

TypeDefinition ros2_definition(const TopicInfo& topic) {
  const std::string text = topic.definition.empty() ? ros2_definition(message_type(topic.type)) : topic.definition;
  if (text.empty()) return {};
  const bool said = !topic.definition.empty() && !topic.definition_encoding.empty();
  return {text, said ? topic.definition_encoding : "ros2msg"};
}

std::string further_definition(const std::string& type) {
  if (!ros2_fields().contains(type)) return {};
  std::vector<std::string> types;
  collect_types(fields_of(type, Ros::two), Ros::two, types);
  return joined_definitions(fields_of(type, Ros::two), types, Ros::two);
}

}  // namespace lodestone
