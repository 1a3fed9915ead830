#pragma once

#include <memory>
#include <string>

#include "frontends/logs/log_writer.h"

namespace lodestone {

/// Writes an MCAP file of ROS 2 messages: chunks of about one megabyte with indexes, a summary, checksums.
class McapWriter : public LogWriter {
 public:
  McapWriter(const std::string& path, Codec codec);
  ~McapWriter() override;

  Encoding encoding() const override { return Encoding::cdr; }
  void write(const TopicInfo& topic, const RawMessage& message) override;
  void close() override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone
