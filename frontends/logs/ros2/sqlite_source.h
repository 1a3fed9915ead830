#pragma once

#include <memory>
#include <string>

#include "core/warnings.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Streams a ROS 2 bag in an SQLite file (.db3). Messages that are packed with zstd are unpacked. Memory contains one
/// message, and 24 bytes per message of the file.
///
/// From a cut-off or damaged file, all rows are read that SQLite can reach: log.cut_off and log.damaged_message in
/// `warnings`, which must outlive this.
class SqliteSource : public MessageSource {
 public:
  /// Throws InputError if the file is missing, is not a database of rosbag2, or has nothing readable.
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
