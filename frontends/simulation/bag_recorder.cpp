#include "frontends/simulation/bag_recorder.h"

#include <cstring>
#include <type_traits>

#include "core/error.h"
#include "frontends/readers/ros1/bag_writer.h"

namespace lodestone::simulation {
namespace {

/// One point as it lies in the message.
struct PackedPoint {
  float x, y, z, intensity;
  std::uint32_t t;
  std::uint16_t ring;
  std::uint16_t padding;
};
static_assert(sizeof(PackedPoint) == 24);

template <class Call>
void as_input_error(Call&& call) {
  try {
    call();
  } catch (const ros1::BagError& error) {
    throw InputError(error.what());
  }
}

std::array<double, 3> as_array(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

struct BagRecorder::Implementation {
  Implementation(const std::string& path, Topics topics_in)
      : writer(path, ros1::Compression::lz4), topics(std::move(topics_in)) {}

  void write(const LidarScan& scan) {
    points.resize(scan.points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const LidarPoint& point = scan.points[i];
      points[i] = {point.position.x(),
                   point.position.y(),
                   point.position.z(),
                   point.intensity,
                   static_cast<std::uint32_t>(point.offset_ns),
                   point.ring,
                   0};
    }
    using Field = ros1::PointField;
    ros1::PointCloudMessage message;
    message.stamp = scan.start;
    message.frame = "lidar";
    message.width = static_cast<std::uint32_t>(points.size());
    message.fields = {{"x", 0, Field::float32},          {"y", 4, Field::float32}, {"z", 8, Field::float32},
                      {"intensity", 12, Field::float32}, {"t", 16, Field::uint32}, {"ring", 20, Field::uint16}};
    message.point_step = sizeof(PackedPoint);
    message.row_step = message.width * message.point_step;
    message.data = reinterpret_cast<const std::uint8_t*>(points.data());
    message.data_size = message.row_step;
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

  ros1::BagWriter writer;
  Topics topics;
  std::vector<PackedPoint> points;
};

BagRecorder::BagRecorder(const std::string& path, Topics topics) {
  as_input_error([&] { implementation_ = std::make_unique<Implementation>(path, std::move(topics)); });
}

BagRecorder::~BagRecorder() = default;

void BagRecorder::write(const Measurement& measurement) {
  as_input_error([&] { std::visit([&](const auto& value) { implementation_->write(value); }, measurement); });
}

void BagRecorder::close() {
  as_input_error([&] { implementation_->writer.close(); });
}

}  // namespace lodestone::simulation
