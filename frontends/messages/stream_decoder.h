#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/messages/bag_streams.h"
#include "frontends/messages/message_decoder.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "frontends/messages/wheel_positions.h"

namespace lodestone {

/// Decodes the messages of a log to samples and scans of the platform's sensors, in SI units. The platform file's clock
/// offsets are subtracted from the stamps, so that all times are of the IMU's clock. A message is decoded on the first
/// call for one of its sensors, and only once.
///
/// All functions except set() throw InputError if the message's bytes are inconsistent or contradict the platform file.
class StreamDecoder {
 public:
  /// `path` names the log in messages. `platform` and `warnings` must outlive this. The scans' decoders add to
  /// `warnings`.
  StreamDecoder(const std::string& path, const Platform& platform, WarningLog& warnings);

  /// Sets the message for the functions below. Its bytes must stay valid.
  void set(const RawMessage& raw);

  /// Stamp of `stream`'s part of the message, by the IMU's clock. A stamp of 0 means no stamp, and stays 0.
  Time stamp(const SensorStream& stream);
  ImuSample imu(const SensorStream& stream);
  /// The uncalibrated reading; calibrated() corrects hard and soft iron.
  MagneticSample field(const SensorStream& stream);
  /// Velocities are divided by the platform file's scale. Empty if positions of wheels have no position before them.
  std::optional<WheelSample> wheels(const SensorStream& stream);
  void scan(const SensorStream& stream, LidarScan& scan);
  /// The cloud with its fields; null if the scan is a CustomMsg. The points are views into the message's bytes.
  const ros1::PointCloudMessage* cloud(const SensorStream& stream);

 private:
  Time clock_offset(const SensorStream& stream) const;
  const ros1::Message& message(const SensorStream& stream);
  const MessagePaths::Vector& vector(const SensorStream& stream, std::size_t index);
  std::optional<WheelSample> wheel_on_each_side(const SensorStream& stream);

  const Platform& platform_;
  MessageDecoder messages_;
  std::vector<PointCloudDecoder> clouds_;  ///< one per LiDAR
  RawMessage raw_;
  ros1::Message message_;
  bool message_is_decoded_ = false;
  std::vector<MessagePaths::Vector> vectors_;  ///< vectors of a message that is read by paths
  bool vectors_are_decoded_ = false;
  WheelPositions wheel_positions_;
};

/// field = soft_iron_correction (reading − hard_iron_ut), in the magnetometer's axes.
Vector3 calibrated(const MagnetometerMessageLayout& layout, const Vector3& reading_ut);

}  // namespace lodestone
