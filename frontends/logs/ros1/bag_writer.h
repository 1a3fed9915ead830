#pragma once

#include <memory>
#include <string>

#include "frontends/logs/log_writer.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone::ros1 {

/// Writes a ROS 1 bag (format 2.0).
class BagWriter : public LogWriter {
 public:
  /// `codec`: none, lz4 or bz2. Throws InputError if the folder cannot be written.
  BagWriter(const std::string& path, Codec codec);
  ~BagWriter() override;

  Encoding encoding() const override { return Encoding::ros1; }

  /// `record_time` (ns, > 0) is the time of arrival, which determines the order of reading. For a scan, it is the
  /// scan's end, whatever the header's stamp is. Throws InputError, also if a stamp does not fit ROS time (0 to
  /// 2³² s).
  /// `Message`: one of PointCloud, Livox, Imu, MagneticField, Odometry.
  template <class Message>
  void write(const std::string& topic, Time record_time, const Message& message);

  /// A serialized message of any type. Checksum and definition are those of the topic, or of a known type. Throws
  /// InputError if the type is unknown too. Each publisher has its own connection.
  void write(const TopicInfo& topic, const RawMessage& message) override;

  /// Writes the index and renames the file. Throws InputError. No further messages can be written.
  void close() override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::ros1
