#pragma once

// How the plain messages are written: roscpp's serializers for them, so that a cloud is not copied into a sensor_msgs
// struct. ROS headers: only for the .cpp files of this folder. (Messages of every log are read in readers/logs.)

#include <ros/serialization.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/MagneticField.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <cstring>

#include "frontends/logs/ros1/messages.h"

namespace lodestone::ros1 {

constexpr Time nanoseconds_per_second = 1'000'000'000;

inline Time from_ros(const ros::Time& time) {
  return static_cast<Time>(time.sec) * nanoseconds_per_second + static_cast<Time>(time.nsec);
}

/// Throws BagError where ROS time (two unsigned 32-bit numbers) cannot hold the stamp.
inline ros::Time to_ros(Time time) {
  if (time < 0 || time / nanoseconds_per_second > 0xFFFFFFFFLL) {
    throw BagError("a stamp of " + std::to_string(time) + " ns does not fit ROS time: expected 0 to 2^32 s");
  }
  return ros::Time(static_cast<std::uint32_t>(time / nanoseconds_per_second),
                   static_cast<std::uint32_t>(time % nanoseconds_per_second));
}

template <class Message>
struct RosType;
template <>
struct RosType<PointCloudMessage> {
  using type = sensor_msgs::PointCloud2;
};
template <>
struct RosType<ImuMessage> {
  using type = sensor_msgs::Imu;
};
template <>
struct RosType<MagneticFieldMessage> {
  using type = sensor_msgs::MagneticField;
};

template <class Message>
std_msgs::Header make_header(const Message& message) {
  std_msgs::Header header;
  header.stamp = to_ros(message.stamp);
  header.frame_id = message.frame;
  return header;
}

template <class Stream>
void next_vector(Stream& stream, const std::array<double, 3>& vector) {
  for (double value : vector) stream.next(value);
}

}  // namespace lodestone::ros1

namespace ros::message_traits {

/// Type name, checksum and definition are those of the ROS message.
#define LODESTONE_ROS_TRAIT(Trait, Type)                                                    \
  template <>                                                                               \
  struct Trait<lodestone::ros1::Type> {                                                     \
    using RosMessage = lodestone::ros1::RosType<lodestone::ros1::Type>::type;               \
    static const char* value() { return Trait<RosMessage>::value(); }                       \
    static const char* value(const lodestone::ros1::Type&) { return Trait<RosMessage>::value(); } \
  };
#define LODESTONE_ROS_TRAITS(Type)     \
  LODESTONE_ROS_TRAIT(MD5Sum, Type)    \
  LODESTONE_ROS_TRAIT(DataType, Type)  \
  LODESTONE_ROS_TRAIT(Definition, Type)
LODESTONE_ROS_TRAITS(PointCloudMessage)
LODESTONE_ROS_TRAITS(ImuMessage)
LODESTONE_ROS_TRAITS(MagneticFieldMessage)
#undef LODESTONE_ROS_TRAITS
#undef LODESTONE_ROS_TRAIT

/// Livox' messages have no Debian package: their definition, comments aside, and its checksum stand here.
template <>
struct MD5Sum<lodestone::ros1::LivoxMessage> {
  static const char* value() { return "e4d6829bdfe657cb6c21a746c86b21a6"; }
  static const char* value(const lodestone::ros1::LivoxMessage&) { return value(); }
};
template <>
struct DataType<lodestone::ros1::LivoxMessage> {
  static const char* value() { return "livox_ros_driver2/CustomMsg"; }
  static const char* value(const lodestone::ros1::LivoxMessage&) { return value(); }
};
template <>
struct Definition<lodestone::ros1::LivoxMessage> {
  static const char* value() {
    static const std::string separator = std::string(80, '=') + "\n";
    static const std::string text =
        "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
        "CustomPoint[] points\n" +
        separator + "MSG: std_msgs/Header\n" + Definition<std_msgs::Header>::value() + separator +
        "MSG: livox_ros_driver2/CustomPoint\n"
        "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n";
    return text.c_str();
  }
  static const char* value(const lodestone::ros1::LivoxMessage&) { return value(); }
};

}  // namespace ros::message_traits

namespace ros::serialization {

template <>
struct Serializer<lodestone::ros1::PointField> {
  template <class Stream>
  static void write(Stream& stream, const lodestone::ros1::PointField& field) {
    stream.next(field.name);
    stream.next(field.offset);
    stream.next(field.datatype);
    stream.next(field.count);
  }
  static std::uint32_t serializedLength(const lodestone::ros1::PointField& field) {
    return static_cast<std::uint32_t>(field.name.size()) + 13;
  }
};

template <>
struct Serializer<lodestone::ros1::PointCloudMessage> {
  using Message = lodestone::ros1::PointCloudMessage;

  template <class Stream>
  static void write(Stream& stream, const Message& message) {
    stream.next(lodestone::ros1::make_header(message));
    stream.next(message.height);
    stream.next(message.width);
    stream.next(message.fields);
    stream.next(static_cast<std::uint8_t>(message.big_endian));
    stream.next(message.point_step);
    stream.next(message.row_step);
    stream.next(static_cast<std::uint32_t>(message.data_size));
    if (message.data_size > 0) std::memcpy(stream.advance(message.data_size), message.data, message.data_size);
    stream.next(static_cast<std::uint8_t>(message.dense));
  }

  static std::uint32_t serializedLength(const Message& message) {
    LStream length;
    length.next(lodestone::ros1::make_header(message));
    length.next(message.fields);
    // height, width, two flags, two steps and the data with its size
    return length.getLength() + 22 + static_cast<std::uint32_t>(message.data_size);
  }
};

template <>
struct Serializer<lodestone::ros1::LivoxMessage> {
  using Message = lodestone::ros1::LivoxMessage;

  template <class Stream>
  static void write(Stream& stream, const Message& message) {
    stream.next(lodestone::ros1::make_header(message));
    stream.next(message.timebase);
    stream.next(message.point_count);
    stream.next(message.lidar_id);
    for (int i = 0; i < 3; ++i) stream.next(std::uint8_t{0});
    stream.next(static_cast<std::uint32_t>(message.data_size / Message::point_step));
    if (message.data_size > 0) std::memcpy(stream.advance(message.data_size), message.data, message.data_size);
  }

  static std::uint32_t serializedLength(const Message& message) {
    // timebase, point_num, lidar_id, rsvd and the list with its size
    return serializationLength(lodestone::ros1::make_header(message)) + 20 +
           static_cast<std::uint32_t>(message.data_size);
  }
};

template <>
struct Serializer<lodestone::ros1::ImuMessage> {
  using Message = lodestone::ros1::ImuMessage;

  template <class Stream>
  static void write(Stream& stream, const Message& message) {
    sensor_msgs::Imu imu;
    imu.header = lodestone::ros1::make_header(message);
    imu.orientation.w = 1.0;
    imu.orientation_covariance[0] = -1.0;  // sensor_msgs/Imu: no orientation in this message
    imu.angular_velocity.x = message.angular_velocity[0];
    imu.angular_velocity.y = message.angular_velocity[1];
    imu.angular_velocity.z = message.angular_velocity[2];
    imu.linear_acceleration.x = message.linear_acceleration[0];
    imu.linear_acceleration.y = message.linear_acceleration[1];
    imu.linear_acceleration.z = message.linear_acceleration[2];
    stream.next(imu);
  }

  static std::uint32_t serializedLength(const Message& message) {
    return serializationLength(lodestone::ros1::make_header(message)) + 37 * sizeof(double);
  }
};

template <>
struct Serializer<lodestone::ros1::MagneticFieldMessage> {
  using Message = lodestone::ros1::MagneticFieldMessage;

  template <class Stream>
  static void write(Stream& stream, const Message& message) {
    stream.next(lodestone::ros1::make_header(message));
    lodestone::ros1::next_vector(stream, message.field_tesla);
    for (int i = 0; i < 9; ++i) stream.next(0.0);  // sensor_msgs/MagneticField: zeros say "covariance unknown"
  }

  static std::uint32_t serializedLength(const Message& message) {
    return serializationLength(lodestone::ros1::make_header(message)) + 12 * sizeof(double);
  }
};

}  // namespace ros::serialization
