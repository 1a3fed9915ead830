#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "frontends/logs/compression.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

enum class LogFormat { rosbag, mcap, db3 };

/// Writes a log under a temporary name in its folder. close() renames the file; without close() the file is deleted.
class LogWriter {
 public:
  virtual ~LogWriter() = default;

  /// The required layout of messages.
  virtual Encoding encoding() const = 0;

  /// `topic` gives name, type and, if known, checksum, definition and metadata. The message's own topic index is
  /// ignored. Throws InputError if the disk is full, or a time cannot be stored.
  virtual void write(const TopicInfo& topic, const RawMessage& message) = 0;

  virtual void close() = 0;
};

/// True if the format supports the compression: chunks of ROS 1 bags with lz4 or bz2, chunks of MCAP with lz4 or zstd,
/// messages of SQLite bags with zstd.
bool can_pack(LogFormat format, Codec codec);

/// Throws InputError if the file cannot be written, std::invalid_argument if the format does not support `codec`.
std::unique_ptr<LogWriter> make_log_writer(const std::string& path, LogFormat format, Codec codec);

/// The writers of ROS 2 messages: an MCAP file, and a bag as an SQLite file.
std::unique_ptr<LogWriter> make_mcap_writer(const std::string& path, Codec codec);
std::unique_ptr<LogWriter> make_sqlite_writer(const std::string& path, Codec codec);

}  // namespace lodestone
