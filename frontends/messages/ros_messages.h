#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/time.h"

/// The messages that Lodestone reads and writes, as plain structs, for both ROS versions.
namespace lodestone::ros1 {

/// The bytes of a message are inconsistent. The caller adds file, topic and time.
class MalformedMessage : public std::runtime_error {
 public:
  explicit MalformedMessage(const std::string& what) : std::runtime_error(what) {}
};

/// sensor_msgs/PointField.
struct PointField {
  /// sensor_msgs/PointField's constants, and PCL's additional ones for 64-bit integers.
  enum Datatype : std::uint8_t {
    int8 = 1,
    uint8 = 2,
    int16 = 3,
    uint16 = 4,
    int32 = 5,
    uint32 = 6,
    float32 = 7,
    float64 = 8,
    int64 = 9,
    uint64 = 10
  };
  std::string name;
  std::uint32_t offset = 0;  ///< bytes from the begin of a point
  std::uint8_t datatype = 0;
  std::uint32_t count = 1;
};

/// sensor_msgs/PointCloud2. The points are a view: the creator of the struct owns the bytes.
struct PointCloudMessage {
  Time stamp = 0;
  std::string frame;
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0;  ///< bytes per point
  std::uint32_t row_step = 0;    ///< bytes per row
  bool dense = true;             ///< no point is NaN
  const std::uint8_t* data = nullptr;
  std::size_t data_size = 0;  ///< bytes
};

/// livox_ros_driver2/CustomMsg; livox_ros_driver's message differs only in its name. The points are packed as described
/// by fields(). They are a view: the creator of the struct owns the bytes.
struct LivoxMessage {
  static constexpr std::uint32_t point_step = 19;  ///< bytes per point

  /// uint32 offset_time (ns after the timebase), float32 x, y, z (m), uint8 reflectivity, tag, line.
  static std::vector<PointField> fields() {
    return {{"offset_time", 0, PointField::uint32},  {"x", 4, PointField::float32},
            {"y", 8, PointField::float32},           {"z", 12, PointField::float32},
            {"reflectivity", 16, PointField::uint8}, {"tag", 17, PointField::uint8},
            {"line", 18, PointField::uint8}};
  }

  Time stamp = 0;
  std::string frame;
  std::uint64_t timebase = 0;  ///< ns, time of the first point by the LiDAR's clock; the stamp is by the host's clock
  std::uint32_t point_count = 0;
  std::uint8_t lidar_id = 0;
  const std::uint8_t* data = nullptr;
  std::size_t data_size = 0;  ///< bytes
};

/// sensor_msgs/Imu without its orientation, which is written as unknown.
struct ImuMessage {
  Time stamp = 0;
  std::string frame;
  std::array<double, 3> angular_velocity{};     ///< rad/s
  std::array<double, 3> linear_acceleration{};  ///< m/s²
};

/// sensor_msgs/MagneticField.
struct MagneticFieldMessage {
  Time stamp = 0;
  std::string frame;
  std::array<double, 3> field_tesla{};
};

/// nav_msgs/Odometry without its pose, which is written as zero. The twist is in the child frame.
struct OdometryMessage {
  Time stamp = 0;
  std::string frame;
  std::string child_frame;
  std::array<double, 3> linear_velocity{};   ///< m/s
  std::array<double, 3> angular_velocity{};  ///< rad/s
};

using Message = std::variant<PointCloudMessage, LivoxMessage, ImuMessage, MagneticFieldMessage, OdometryMessage>;

}  // namespace lodestone::ros1
