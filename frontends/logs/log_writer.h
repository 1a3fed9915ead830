#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "frontends/logs/compression.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

enum class LogFormat { rosbag, mcap, db3 };

/// Writes a log. The file is written aside in its folder and gets its name in close(); without that nothing is left.
class LogWriter {
 public:
  virtual ~LogWriter() = default;

  /// How the messages must be laid out.
  virtual Encoding encoding() const = 0;

  /// `topic` gives name, type and, where it has them, checksum, definition and metadata; the message's own number of
  /// the topic is not looked at. Throws InputError where the disk does not take it, or a time cannot be stored.
  virtual void write(const TopicInfo& topic, const RawMessage& message) = 0;

  virtual void close() = 0;
};

/// Whether the format can be packed so: chunks of ROS 1 bags by lz4 or bz2, those of MCAP by lz4 or zstd, each message
/// of an SQLite bag by zstd.
bool can_pack(LogFormat format, Codec codec);

/// Throws InputError where the file cannot be written, std::invalid_argument where the format is not packed so.
std::unique_ptr<LogWriter> make_log_writer(const std::string& path, LogFormat format, Codec codec);

}  // namespace lodestone
