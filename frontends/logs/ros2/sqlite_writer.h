#pragma once

#include <memory>
#include <string>

#include "frontends/logs/log_writer.h"

namespace lodestone {

/// Writes a ROS 2 bag as an SQLite file with the tables of rosbag2's schema 4.
class SqliteWriter : public LogWriter {
 public:
  SqliteWriter(const std::string& path, Codec codec);
  ~SqliteWriter() override;

  Encoding encoding() const override { return Encoding::cdr; }
  void write(const TopicInfo& topic, const RawMessage& message) override;
  void close() override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone
