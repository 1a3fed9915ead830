#include "frontends/messages/result_messages.h"

#include <limits>
#include <stdexcept>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_writing.h"
#include "frontends/messages/wire_cdr.h"

namespace lodestone {
namespace {

void check_ros2_stamp(Time stamp) {
  constexpr Time largest_s = std::numeric_limits<std::int32_t>::max();
  if (stamp >= 0 && stamp / 1'000'000'000 <= largest_s) return;
  throw InputError("a stamp of " + format_stamp(stamp) +
                   " s does not fit ROS 2, which requires 0 to 2147483647 s; export a trajectory (--to tum) instead");
}

void write_result_header(CdrWireWriter& wire, Time stamp, const std::string& frame) {
  check_ros2_stamp(stamp);
  wire.header(stamp, frame);
}

/// geometry_msgs/Pose and geometry_msgs/Transform have the same layout.
void write_pose(CdrWireWriter& wire, const Pose& pose) {
  for (const double value : pose.position) wire.number(value);
  for (const double value : pose.rotation.coeffs()) wire.number(value);  // Eigen's order is x y z w, as in ROS
}

}  // namespace

TopicInfo result_topic(const std::string& name, const std::string& type) {
  TopicInfo topic;
  topic.name = name;
  topic.type = type;
  topic.encoding = Encoding::cdr;
  const bool cloud = message_type(type) == MessageType::point_cloud;
  topic.definition = cloud ? ros2_definition(MessageType::point_cloud) : further_definition(type);
  if (topic.definition.empty()) throw std::invalid_argument("result_topic: unknown type " + type);
  topic.definition_encoding = "ros2msg";
  return topic;
}

RosCovariance ros_covariance(const Pose& T_map_imu, const Matrix6& covariance) {
  RosCovariance values{};
  if (!covariance.allFinite()) return values;
  Matrix6 to_ros = Matrix6::Zero();  // (p, R φ) from (φ, p)
  to_ros.topRightCorner<3, 3>().setIdentity();
  to_ros.bottomLeftCorner<3, 3>() = T_map_imu.rotation.toRotationMatrix();
  const Matrix6 ordered = to_ros * covariance * to_ros.transpose();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column)
      values[static_cast<std::size_t>(6 * row + column)] = ordered(row, column);
  }
  return values;
}

std::vector<std::uint8_t> transform_message(Time stamp, const std::string& frame, const std::string& child_frame,
                                            const Pose& pose) {
  CdrWireWriter wire;
  wire.number(std::uint32_t{1});
  write_result_header(wire, stamp, frame);
  wire.text(child_frame);
  write_pose(wire, pose);
  return wire.take();
}

std::vector<std::uint8_t> path_message(Time stamp, const std::string& frame, const Trajectory& poses) {
  CdrWireWriter wire;
  write_result_header(wire, stamp, frame);
  wire.number(static_cast<std::uint32_t>(poses.size()));
  for (const StampedPose& pose : poses) {
    write_result_header(wire, pose.time, frame);
    write_pose(wire, pose.pose);
  }
  return wire.take();
}

std::vector<std::uint8_t> odometry_message(Time stamp, const std::string& frame, const std::string& child_frame,
                                           const Pose& pose, const RosCovariance& covariance) {
  constexpr int twist_numbers = 6 + 36;  // linear, angular, covariance
  CdrWireWriter wire;
  write_result_header(wire, stamp, frame);
  wire.text(child_frame);
  write_pose(wire, pose);
  for (const double value : covariance) wire.number(value);
  for (int i = 0; i < twist_numbers; ++i) wire.number(0.0);
  return wire.take();
}

std::vector<std::uint8_t> diagnostics_message(Time stamp, const DiagnosticStatus& status) {
  CdrWireWriter wire;
  write_result_header(wire, stamp, "");
  wire.number(std::uint32_t{1});
  wire.number(static_cast<std::uint8_t>(status.level));
  wire.text(status.name);
  wire.text(status.message);
  wire.text(status.hardware_id);
  wire.number(static_cast<std::uint32_t>(status.values.size()));
  for (const auto& [key, value] : status.values) {
    wire.text(key);
    wire.text(value);
  }
  return wire.take();
}

std::vector<std::uint8_t> cloud_message(const ros1::PointCloudMessage& cloud) {
  check_ros2_stamp(cloud.stamp);
  CdrWireWriter wire;
  writing::write(wire, cloud);
  return wire.take();
}

}  // namespace lodestone
