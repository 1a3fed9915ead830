#pragma once

#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/logs/ros1/bag_writer.h"

namespace lodestone::testing {

/// A short log of a robot at rest, with one defect per test. The hooks change a message before it is written; if a hook
/// returns false, the message is not written.
struct SyntheticLog {
  Time start = 1'700'000'000'000'000'000;
  int scans = 20;
  int points_per_scan = 2048;
  int magnetometers = 2;
  bool lidar = true;
  Codec compression = Codec::lz4;
  std::function<bool(int, ros1::PointCloudMessage&, std::vector<std::uint8_t>&)> on_scan;
  std::function<bool(int, ros1::ImuMessage&)> on_imu;
  std::function<bool(int, int, ros1::MagneticFieldMessage&)> on_field;  ///< sample, magnetometer

  std::function<bool(int, ros1::OdometryMessage&)> on_wheels;  ///< empty: the robot has no wheel odometry

  std::function<Time(Time)> on_record;  ///< when a message of this record time was recorded instead

  static constexpr std::uint32_t point_step = 32;
  static constexpr Time period = 100'000'000;
  static constexpr Time imu_period = 5'000'000;
  static constexpr Time field_period = 10'000'000;
  static constexpr Time wheel_period = 20'000'000;

  Time recorded(Time time) const { return on_record ? on_record(time) : time; }

  static void put(std::vector<std::uint8_t>& data, int point, int offset, const void* value, std::size_t size) {
    std::memcpy(data.data() + point * point_step + offset, value, size);
  }

  /// Ouster's layout: x, y, z, intensity (float32), t (uint32, ns), ring (uint16).
  void write_scan(ros1::BagWriter& writer, int scan) const {
    std::vector<std::uint8_t> data(static_cast<std::size_t>(points_per_scan) * point_step);
    for (int i = 0; i < points_per_scan; ++i) {
      const float position[3] = {10.0F + 0.001F * static_cast<float>(i), -2.0F, 1.0F};
      const float intensity = static_cast<float>(i % 100);
      const auto time = static_cast<std::uint32_t>(period / points_per_scan * i);
      const auto ring = static_cast<std::uint16_t>(i % 32);
      put(data, i, 0, position, 12);
      put(data, i, 16, &intensity, 4);
      put(data, i, 20, &time, 4);
      put(data, i, 24, &ring, 2);
    }
    ros1::PointCloudMessage cloud;
    cloud.stamp = start + scan * period;
    cloud.frame = "lidar";
    cloud.fields = {{"x", 0, 7, 1},          {"y", 4, 7, 1},  {"z", 8, 7, 1},
                    {"intensity", 16, 7, 1}, {"t", 20, 6, 1}, {"ring", 24, 4, 1}};
    cloud.point_step = point_step;
    cloud.height = 32;
    cloud.width = static_cast<std::uint32_t>(points_per_scan / 32);
    const Time record_time = cloud.stamp + period;
    if (on_scan && !on_scan(scan, cloud, data)) return;
    cloud.row_step = cloud.width * cloud.point_step;
    cloud.data = data.data();
    cloud.data_size = data.size();
    writer.write("/ouster/points", recorded(record_time), cloud);
  }

  void write_imu(ros1::BagWriter& writer, int i) const {
    ros1::ImuMessage imu;
    imu.stamp = start + i * imu_period - 2'000'000;
    imu.linear_acceleration = {0.0, 0.0, 9.80665};
    imu.angular_velocity = {0.0, 0.0, 0.001 * i};
    const Time record_time = imu.stamp;
    if (!on_imu || on_imu(i, imu)) writer.write("/imu/data", recorded(record_time), imu);
  }

  void write_fields(ros1::BagWriter& writer, int i) const {
    for (int k = 0; k < magnetometers; ++k) {
      ros1::MagneticFieldMessage field;
      field.stamp = start + i * field_period + 1'000'000;
      field.field_tesla = {20e-6, 1e-6 * k, -40e-6};
      const Time record_time = field.stamp;
      if (on_field && !on_field(i, k, field)) continue;
      writer.write("/magnetometer_" + std::to_string(k) + "/field", recorded(record_time), field);
    }
  }

  void write_wheels(ros1::BagWriter& writer, int i) const {
    ros1::OdometryMessage odometry;
    odometry.stamp = start + i * wheel_period + 3'000'000;
    odometry.frame = "odom";
    odometry.child_frame = "base_link";
    odometry.linear_velocity = {0.01 * i, 0.02, 0.5};
    odometry.angular_velocity = {0.1, 0.2, 0.3};
    const Time record_time = odometry.stamp;
    if (on_wheels && on_wheels(i, odometry)) writer.write("/odom", recorded(record_time), odometry);
  }

  /// In the order of a recorder: otherwise reading alternates between compressed chunks.
  void write(const std::string& path) const {
    ros1::BagWriter writer(path, compression);
    const Time duration = scans * period + 20'000'000;
    for (Time t = 0; t <= duration; t += imu_period) {
      write_imu(writer, static_cast<int>(t / imu_period));
      if (t % field_period == 0) write_fields(writer, static_cast<int>(t / field_period));
      if (t % wheel_period == 0) write_wheels(writer, static_cast<int>(t / wheel_period));
      if (lidar && t % period == 0 && t > 0) write_scan(writer, static_cast<int>(t / period) - 1);
    }
    writer.close();
  }

  Platform platform() const {
    Platform result;
    result.file = "platform.yaml";
    for (int k = 0; k < magnetometers; ++k) {
      result.magnetometers.push_back({"/magnetometer_" + std::to_string(k) + "/field", FieldUnit::tesla});
      const Pose T_imu_mag{Quaternion::Identity(), {0.1 * k, 0.0, 0.0}};
      result.suite.magnetometers.push_back({"magnetometer_" + std::to_string(k), T_imu_mag, 1.0});
    }
    return result;
  }
};

}  // namespace lodestone::testing
