#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "core/time.h"
#include "frontends/logs/log_writer.h"

namespace lodestone {

/// Writes a ROS 2 bag as recorders do: a folder with one SQLite file and metadata.yaml, which `ros2 bag play` requires.
/// The folder is written under a temporary name. close() renames the folder; without close() the folder is deleted.
class BagFolderWriter : public LogWriter {
 public:
  /// A folder of an earlier export at `path` is replaced by close(). Throws InputError if `path` has other content.
  explicit BagFolderWriter(const std::string& path);
  ~BagFolderWriter() override;

  Encoding encoding() const override { return Encoding::cdr; }
  void write(const TopicInfo& topic, const RawMessage& message) override;
  void close() override;

 private:
  struct WrittenTopic {
    std::string type;  ///< in the form of ROS 2
    std::int64_t messages = 0;
  };
  std::string metadata() const;

  std::string path_, aside_;
  std::unique_ptr<LogWriter> file_;
  std::map<std::string, WrittenTopic> topics_;  ///< by name
  std::int64_t messages_ = 0;
  Time begin_ = 0, end_ = 0;
};

}  // namespace lodestone
