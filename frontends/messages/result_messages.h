#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/trajectory.h"
#include "frontends/messages/message_source.h"
#include "frontends/messages/ros_messages.h"

/// Results as messages of ROS 2, in CDR.
namespace lodestone {

/// A topic with the type's definition. `type` in the form of TopicInfo: tf2_msgs/TFMessage, nav_msgs/Path,
/// nav_msgs/Odometry, diagnostic_msgs/DiagnosticArray or sensor_msgs/PointCloud2. Throws std::invalid_argument for
/// other types.
TopicInfo result_topic(const std::string& name, const std::string& type);

/// Row-major, order x y z, rotation about X, Y, Z, as in geometry_msgs/PoseWithCovariance.
using RosCovariance = std::array<double, 36>;

/// Converts a covariance of tangent order φ (right, body), p (map) to ROS' order and axes: ROS rotates about the fixed
/// axes of the header's frame, and R Exp(φ) = Exp(R φ) R. All zeros if an entry is not finite.
RosCovariance ros_covariance(const Pose& T_map_imu, const Matrix6& covariance);

/// One diagnostic_msgs/DiagnosticStatus.
struct DiagnosticStatus {
  enum Level : std::uint8_t { ok = 0, warn = 1, error = 2 };
  Level level = ok;
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

/// The functions below throw InputError if the stamp does not fit ROS 2: before 1970 or after 2038.

/// tf2_msgs/TFMessage with one transform.
std::vector<std::uint8_t> transform_message(Time stamp, const std::string& frame, const std::string& child_frame,
                                            const Pose& pose);

/// nav_msgs/Path. Each pose has its own stamp.
std::vector<std::uint8_t> path_message(Time stamp, const std::string& frame, const Trajectory& poses);

/// nav_msgs/Odometry. The twist is zero.
std::vector<std::uint8_t> odometry_message(Time stamp, const std::string& frame, const std::string& child_frame,
                                           const Pose& pose, const RosCovariance& covariance);

/// diagnostic_msgs/DiagnosticArray with one status.
std::vector<std::uint8_t> diagnostics_message(Time stamp, const DiagnosticStatus& status);

/// sensor_msgs/PointCloud2.
std::vector<std::uint8_t> cloud_message(const ros1::PointCloudMessage& cloud);

}  // namespace lodestone
