#include "tools/simulate/bag_recorder.h"

#include <cstring>

#include "frontends/logs/ros1/bag_writer.h"

namespace lodestone::simulation {
namespace {

using Field = ros1::PointField;

// Binary layout of one point in each message; Livox' drivers pack their points.
struct OusterPoint {
  float x, y, z, intensity;
  std::uint32_t t;
  std::uint16_t ring;
  std::uint16_t padding;
};
static_assert(sizeof(OusterPoint) == 24);

#pragma pack(push, 1)
struct LivoxCloudPoint {
  float x, y, z, intensity;
  std::uint8_t tag, line;
  double timestamp;
};
struct LivoxCustomPoint {
  std::uint32_t offset_time;
  float x, y, z;
  std::uint8_t reflectivity, tag, line;
};
#pragma pack(pop)
static_assert(sizeof(LivoxCloudPoint) == 26);
static_assert(sizeof(LivoxCustomPoint) == ros1::LivoxMessage::point_step);

std::vector<Field> ouster_fields() {
  return {{"x", 0, Field::float32},          {"y", 4, Field::float32}, {"z", 8, Field::float32},
          {"intensity", 12, Field::float32}, {"t", 16, Field::uint32}, {"ring", 20, Field::uint16}};
}

std::vector<Field> livox_fields() {
  return {{"x", 0, Field::float32},          {"y", 4, Field::float32},  {"z", 8, Field::float32},
          {"intensity", 12, Field::float32}, {"tag", 16, Field::uint8}, {"line", 17, Field::uint8},
          {"timestamp", 18, Field::float64}};
}

std::array<double, 3> as_array(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

struct BagRecorder::Implementation {
  Implementation(const std::string& path, Topics topics_in, ScanFormat format_in)
      : writer(path, Codec::lz4), topics(std::move(topics_in)), format(format_in) {}

  void write(const LidarScan& scan) {
    switch (format) {
      case ScanFormat::ouster:
        pack<OusterPoint>(scan, [](const LidarPoint& p) {
          return OusterPoint{p.position.x(),
                             p.position.y(),
                             p.position.z(),
                             p.intensity,
                             static_cast<std::uint32_t>(p.offset_ns),
                             p.ring,
                             0};
        });
        return write_cloud(scan, ouster_fields(), sizeof(OusterPoint));
      case ScanFormat::livox:
        pack<LivoxCloudPoint>(scan, [&scan](const LidarPoint& p) {
          return LivoxCloudPoint{p.position.x(),
                                 p.position.y(),
                                 p.position.z(),
                                 p.intensity,
                                 0,
                                 static_cast<std::uint8_t>(p.ring),
                                 static_cast<double>(scan.start + p.offset_ns)};
        });
        return write_cloud(scan, livox_fields(), sizeof(LivoxCloudPoint));
      case ScanFormat::livox_custom:
        pack<LivoxCustomPoint>(scan, [](const LidarPoint& p) {
          return LivoxCustomPoint{static_cast<std::uint32_t>(p.offset_ns),
                                  p.position.x(),
                                  p.position.y(),
                                  p.position.z(),
                                  static_cast<std::uint8_t>(p.intensity),
                                  0,
                                  static_cast<std::uint8_t>(p.ring)};
        });
        return write_custom(scan);
    }
  }

  template <class Packed, class Convert>
  void pack(const LidarScan& scan, const Convert& convert) {
    bytes.resize(scan.points.size() * sizeof(Packed));
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const Packed packed = convert(scan.points[i]);
      std::memcpy(bytes.data() + i * sizeof(Packed), &packed, sizeof(Packed));
    }
  }

  void write_cloud(const LidarScan& scan, std::vector<Field> fields, std::size_t point_step) {
    ros1::PointCloudMessage message;
    message.stamp = scan.start;
    message.frame = "lidar";
    message.width = static_cast<std::uint32_t>(scan.points.size());
    message.fields = std::move(fields);
    message.point_step = static_cast<std::uint32_t>(point_step);
    message.row_step = message.width * message.point_step;
    message.data = bytes.data();
    message.data_size = bytes.size();
    writer.write(topics.lidar, scan.end, message);
  }

  void write_custom(const LidarScan& scan) {
    ros1::LivoxMessage message;
    message.stamp = scan.start;
    message.frame = "lidar";
    message.timebase = static_cast<std::uint64_t>(scan.start);
    message.point_count = static_cast<std::uint32_t>(scan.points.size());
    message.data = bytes.data();
    message.data_size = bytes.size();
    writer.write(topics.lidar, scan.end, message);
  }

  void write(const ImuSample& sample) {
    ros1::ImuMessage message;
    message.stamp = sample.time;
    message.frame = "imu";
    message.angular_velocity = as_array(sample.angular_velocity);
    message.linear_acceleration = as_array(sample.linear_acceleration);
    writer.write(topics.imu, sample.time, message);
  }

  void write(const MagneticSample& sample) {
    ros1::MagneticFieldMessage message;
    message.stamp = sample.time;
    message.frame = "magnetometer_" + std::to_string(sample.magnetometer);
    message.field_tesla = as_array(sample.field_ut * 1e-6);
    writer.write(topics.magnetometers.at(static_cast<std::size_t>(sample.magnetometer)), sample.time, message);
  }

  void write(const WheelSample& sample) {
    ros1::OdometryMessage message;
    message.stamp = sample.time;
    message.frame = "odom";
    message.child_frame = "wheels";
    message.linear_velocity = {sample.forward_velocity_m_s, sample.lateral_velocity_m_s, 0.0};
    message.angular_velocity = {0.0, 0.0, sample.yaw_rate_rad_s};
    writer.write(topics.wheels, sample.time, message);
  }

  ros1::BagWriter writer;
  Topics topics;
  ScanFormat format;
  std::vector<std::uint8_t> bytes;  ///< of a scan's points
};

ScanFormat scan_format(const LidarOptions& options) {
  if (options.message == LidarMessage::livox_custom) return ScanFormat::livox_custom;
  return options.pattern == LidarPattern::rosette ? ScanFormat::livox : ScanFormat::ouster;
}

LidarMessageLayout message_layout(ScanFormat format) {
  LidarMessageLayout layout;  // as in Ouster's driver
  if (format == ScanFormat::ouster) return layout;
  layout.topic = "/livox/lidar";
  const bool custom = format == ScanFormat::livox_custom;  // its fields are fixed by the message type
  layout.intensity_field = custom ? "" : "intensity";
  layout.ring_field = custom ? "" : "line";
  layout.time_field = custom ? "" : "timestamp";
  if (custom) layout.time_unit.reset();
  return layout;
}

BagRecorder::BagRecorder(const std::string& path, Topics topics, ScanFormat format) {
  implementation_ = std::make_unique<Implementation>(path, std::move(topics), format);
}

BagRecorder::~BagRecorder() = default;

void BagRecorder::write(const Measurement& measurement) {
  std::visit([&](const auto& value) { implementation_->write(value); }, measurement);
}

void BagRecorder::close() {
  implementation_->writer.close();
}

}  // namespace lodestone::simulation
