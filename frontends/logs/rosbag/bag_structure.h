#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/time.h"
#include "frontends/logs/file_bytes.h"

namespace lodestone {

/// The file ends before its index does: what lies ahead can be read (cut_bag.h).
class BagCutOff : public InputError {
 public:
  explicit BagCutOff(const std::string& message) : InputError(message) {}
};

/// Holds the lengths and offsets that a ROS 1 bag says of itself against its bytes, for rosbag_storage believes them: of a
/// bag with a few altered bytes it may read far outside its buffers.
///
/// The constructor walks the records of the file; a chunk's content is looked at when the reader comes to its time.
class BagStructure {
 public:
  /// Throws BagCutOff; InputError, with the byte, where the file is missing, no ROS 1 bag of version 2.0, or contradicts
  /// itself.
  explicit BagStructure(const std::string& path);

  /// Checks the messages in each chunk that has one recorded at `time` or earlier. Throws InputError.
  void check_until(Time time);


 private:
  struct IndexRecord {
    std::uint32_t connection = 0;
    std::uint32_t count = 0;
    std::uint64_t offset = 0;  ///< of its entries in the file
  };
  struct Chunk {
    std::uint64_t record = 0;  ///< where its record starts
    std::uint64_t data = 0;    ///< where its content starts
    std::uint32_t packed = 0;  ///< bytes
    std::uint32_t size = 0;    ///< bytes when unpacked
    std::string compression;
    std::vector<IndexRecord> indexes;
    Time begin = 0;
  };
  struct Record;

  [[noreturn]] void fail(std::uint64_t byte, const std::string& what) const;
  [[noreturn]] void fail_truncated(const std::string& what) const;
  void walk();
  Record read_record(std::uint64_t offset) const;
  void add_chunk(const Record& record);
  void add_index(const Record& record);
  void check_connection(const Record& record) const;
  void check_chunk_info(const Record& record);
  void check_chunk(const Chunk& chunk);

  FileBytes file_;
  std::vector<Chunk> chunks_;  ///< in order of `begin` after construction
  std::size_t checked_ = 0;    ///< so many of them
  std::vector<std::uint8_t> packed_, content_, entries_;
};

}  // namespace lodestone
