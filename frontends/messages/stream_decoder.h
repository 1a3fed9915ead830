#pragma once

#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/messages/bag_streams.h"
#include "frontends/messages/message_decoder.h"
#include "frontends/messages/point_cloud_decoder.h"

namespace lodestone {

/// What the messages of a log say of the platform's sensors, in the platform's units: samples and scans, whatever
/// messages they lie in. The clock offsets of the platform file are subtracted from the stamps, so that every time is
/// the IMU's. A message is decoded when the first of its sensors asks, and once for all of them.
///
/// Every call but set() throws InputError where the message's bytes contradict themselves or the platform file.
class StreamDecoder {
 public:
  /// `path` names the log in messages. `platform` and `warnings` must outlive this; `warnings` gets what the scans'
  /// decoders have to say.
  StreamDecoder(const std::string& path, const Platform& platform, WarningLog& warnings);

  /// The message of which the calls below speak. Its bytes must hold until then.
  void set(const RawMessage& raw);

  /// Of `stream`'s part of the message, by the IMU's clock. A stamp of 0 means that there is none, and stays 0.
  Time stamp(const SensorStream& stream);
  ImuSample imu(const SensorStream& stream);
  /// As it was read: calibrated() takes hard and soft iron off.
  MagneticSample field(const SensorStream& stream);
  void scan(const SensorStream& stream, LidarScan& scan);
  /// The cloud with its fields; null where the scan is a CustomMsg. The points are views into the message's bytes.
  const ros1::PointCloudMessage* cloud(const SensorStream& stream);

 private:
  Time clock_offset(const SensorStream& stream) const;
  const ros1::Message& message(const SensorStream& stream);
  const MessagePaths::Vector& vector(const SensorStream& stream, std::size_t index);

  const Platform& platform_;
  MessageDecoder messages_;
  std::vector<PointCloudDecoder> clouds_;  ///< one a LiDAR
  RawMessage raw_;
  ros1::Message message_;
  bool message_holds_ = false;
  std::vector<MessagePaths::Vector> vectors_;  ///< of a message that is read by paths
  bool vectors_hold_ = false;
};

/// field = soft_iron_correction (reading − hard_iron_ut), in the magnetometer's own axes.
Vector3 calibrated(const MagnetometerMessageLayout& layout, const Vector3& reading_ut);

}  // namespace lodestone
