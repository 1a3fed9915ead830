#pragma once

#include <memory>
#include <string>

#include "frontends/logs/compression.h"
#include "frontends/logs/message_source.h"
#include "frontends/logs/ros1/messages.h"

namespace lodestone::ros1 {

/// Writes a ROS 1 bag (format 2.0). The file is written aside in the same folder and gets its name in close(), so that
/// nobody ever sees half a bag; without close() nothing is left behind.
class BagWriter {
 public:
  /// `codec`: none, lz4 or bz2. Throws BagError where the folder cannot be written.
  BagWriter(const std::string& path, Codec codec);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// `record_time` (ns, > 0) is when the message would have arrived: the order in which the bag is read back. For a
  /// scan that is its end, whatever its header's stamp says. Throws BagError, also where a stamp does not fit ROS time
  /// (0 to 2³² s).
  void write(const std::string& topic, Time record_time, const PointCloudMessage& message);
  void write(const std::string& topic, Time record_time, const LivoxMessage& message);
  void write(const std::string& topic, Time record_time, const ImuMessage& message);
  void write(const std::string& topic, Time record_time, const MagneticFieldMessage& message);

  /// A message of any type that lies serialized already. Checksum and definition are the topic's, or where it has none
  /// those of a known type; throws BagError where the type is unknown too. Each publisher has a connection of its own.
  void write(const TopicInfo& topic, Time record_time, const std::uint8_t* data, std::size_t size,
             const Publisher* publisher = nullptr);

  /// Writes the index and gives the file its name. Throws BagError. Nothing can be written afterwards.
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::ros1
