#include "frontends/messages/known_types.h"

namespace lodestone {
namespace {

/// ROS 1 and ROS 2 differ in the header's fields and in defaults, which ROS 1's definitions do not have.
enum class Ros { one, two };

const std::string separator_line = std::string(80, '=') + "\n";

std::string header_definition(Ros ros) {
  const std::string name = separator_line + "MSG: std_msgs/Header\n";
  if (ros == Ros::one) return name + "uint32 seq\ntime stamp\nstring frame_id\n";
  return name + "builtin_interfaces/Time stamp\nstring frame_id\n" + separator_line +
         "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

constexpr const char* vector_fields = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

std::string quaternion_definition(Ros ros) {
  return separator_line + "MSG: geometry_msgs/Quaternion\n" +
         (ros == Ros::one ? "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
                          : "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n");
}

std::string definition_of(MessageType type, Ros ros) {
  const std::string header = header_definition(ros);
  const std::string vector = separator_line + vector_fields;
  switch (type) {
    case MessageType::point_cloud:
      return "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n"
             "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" +
             separator_line + "MSG: sensor_msgs/PointField\n" +
             "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
             "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n" +
             header;
    case MessageType::livox:
      return "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
             "livox_ros_driver2/CustomPoint[] points\n" +
             separator_line + "MSG: livox_ros_driver2/CustomPoint\n" +
             "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n" +
             header;
    case MessageType::imu:
      return "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
             "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
             "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n" +
             quaternion_definition(ros) + vector + header;
    case MessageType::magnetic_field:
      return "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n" +
             vector + header;
    case MessageType::odometry:
      return "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
             "geometry_msgs/TwistWithCovariance twist\n" +
             separator_line + "MSG: geometry_msgs/PoseWithCovariance\n" +
             "geometry_msgs/Pose pose\nfloat64[36] covariance\n" + separator_line + "MSG: geometry_msgs/Pose\n" +
             "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n" + separator_line +
             "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" + quaternion_definition(ros) +
             separator_line + "MSG: geometry_msgs/TwistWithCovariance\n" +
             "geometry_msgs/Twist twist\nfloat64[36] covariance\n" + separator_line + "MSG: geometry_msgs/Twist\n" +
             "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n" + vector + header;
    case MessageType::other:
      break;
  }
  return {};
}

}  // namespace

MessageType message_type(const std::string& type) {
  if (type == "sensor_msgs/PointCloud2") return MessageType::point_cloud;
  if (type == "livox_ros_driver2/CustomMsg" || type == "livox_ros_driver/CustomMsg") return MessageType::livox;
  if (type == "sensor_msgs/Imu") return MessageType::imu;
  if (type == "sensor_msgs/MagneticField") return MessageType::magnetic_field;
  if (type == "nav_msgs/Odometry") return MessageType::odometry;
  return MessageType::other;
}

std::string expected_md5(MessageType type) {
  switch (type) {
    case MessageType::point_cloud:
      return "1158d486dd51d683ce2f1be655c3c181";
    case MessageType::livox:
      return "e4d6829bdfe657cb6c21a746c86b21a6";
    case MessageType::imu:
      return "6a62c6daae103f4ff57a132d6f95cec2";
    case MessageType::magnetic_field:
      return "2f3b0b43eed0c9501de0fa3ff89a45aa";
    case MessageType::odometry:
      return "cd5e73d190d741a2f92e81eda573aca7";
    case MessageType::other:
      break;
  }
  return {};
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

}  // namespace lodestone
