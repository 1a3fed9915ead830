#pragma once

#include <memory>
#include <string>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// Streams a ROS 2 bag in an SQLite file (.db3). Messages packed by zstd one by one are unpacked. In memory are one
/// message and 24 bytes for each of the file's.
///
/// Of a file that a crash cut off, or with damaged pages, it gives the rows that SQLite can still reach: log.cut_off
/// and log.damaged_message in `warnings`, which must outlive this.
class SqliteSource : public MessageSource {
 public:
  /// Throws InputError where the file is missing, no database, none of rosbag2's, or nothing of it can be read.
  SqliteSource(const std::string& path, WarningLog& warnings);
  ~SqliteSource() override;

  const std::vector<TopicInfo>& topics() const override;
  void select(const std::vector<std::string>& names) override;
  bool next(RawMessage& message) override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone
