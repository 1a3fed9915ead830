// ROS 1 bags with altered bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "frontends/configuration/text_file.h"
#include "frontends/logs/ros1/bag_index.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "tests/frontends/logs/bag_messages.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone::ros1 {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::testing::HasSubstr;

PointCloudMessage cloud_at(Time stamp, const std::vector<std::uint8_t>& bytes) {
  PointCloudMessage cloud = cloud_of(bytes);
  cloud.stamp = stamp;
  return cloud;
}

/// Replaces `from` by `to` once in a bag that is not packed, after `skip` other places.
void alter(const std::string& path, const std::string& from, const std::string& to, std::size_t skip = 0) {
  std::string bag = read_text_file(path);
  std::size_t at = bag.find(from);
  for (; skip > 0; --skip) at = bag.find(from, at + 1);
  ASSERT_NE(at, std::string::npos);
  bag.replace(at, to.size(), to);
  std::ofstream(path, std::ios::binary) << bag;
}

/// What is left of a bag of five chunks of two messages each.
class AlteredBag : public ::testing::Test {
 protected:
  AlteredBag() {
    const std::vector<std::uint8_t> bytes(400'000);
    BagWriter writer(path_, Codec::none);
    for (int i = 0; i < kMessages; ++i) {
      writer.write("/points", bag_start + i, cloud_at(bag_start + i, bytes));
    }
    writer.close();
  }

  /// Times after `bag_start` of the messages that are read.
  std::vector<Time> read() {
    BagIndex index(path_, warnings_);
    std::vector<Time> times;
    LoadedSegment loaded;
    for (std::size_t i = 0; i < index.segment_count(); ++i) {
      index.load(i, loaded);
      for (const SegmentEntry& entry : loaded.entries) {
        if (index.topic_of(entry.channel) == 0) times.push_back(entry.time - bag_start);
      }
    }
    return times;
  }

  std::uint64_t index_start() const {
    const std::string bag = read_text_file(path_);
    const std::string field = "index_pos=";
    return little_endian<std::uint64_t>(
        reinterpret_cast<const std::uint8_t*>(bag.data() + bag.find(field) + field.size()));
  }

  static constexpr int kMessages = 10;
  const std::vector<Time> all_{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "log.bag";
  WarningLog warnings_;
};

TEST_F(AlteredBag, IsReadWholeAsLongAsItsMessagesAreWhole) {
  EXPECT_EQ(read(), all_);
  EXPECT_TRUE(warnings_.entries().empty());
}

TEST_F(AlteredBag, WithoutItsIndexIsReadFromItsChunks) {
  std::string bag = read_text_file(path_);
  std::fill(bag.begin() + static_cast<std::ptrdiff_t>(index_start()), bag.end(), '\0');
  std::ofstream(path_, std::ios::binary) << bag;
  EXPECT_EQ(read(), all_);
  EXPECT_EQ(warnings_.count("log.damaged_record"), 1);
}

TEST_F(AlteredBag, AfterADamagedRecordContinuesWithTheNextChunk) {
  alter(path_, std::string("op=\4", 4), std::string("op=\2", 4), 1);  // index of the second chunk
  EXPECT_EQ(read(), all_);
  EXPECT_EQ(warnings_.count("log.damaged_record"), 1);
}

TEST_F(AlteredBag, OfAChunkWhoseHeaderIsDamagedTheOthersAreRead) {
  alter(path_, "compression=none", "compression=nine", 2);
  EXPECT_EQ(read(), (std::vector<Time>{0, 1, 2, 3, 6, 7, 8, 9}));
  EXPECT_THAT(warnings_.entries().at("log.damaged_record").first_detail,
              HasSubstr("the compression 'nine' is unknown; expected none, lz4 or bz2"));
}

TEST_F(AlteredBag, AnIndexOfAnotherLengthIsNotBelieved) {
  alter(path_, std::string("count=\2\0\0\0", 10), std::string("count=\1\0\0\0", 10), 3);
  EXPECT_EQ(read(), all_);
  EXPECT_EQ(warnings_.count("log.damaged_record"), 1);
}

std::string bytes_of(std::uint32_t number) {
  return {reinterpret_cast<const char*>(&number), sizeof(number)};
}

// The index entry of the first message of the third chunk: its time is also in the message's record and in its stamp.
TEST_F(AlteredBag, AnIndexThatContradictsItsChunkIsNotBelieved) {
  constexpr auto kNanoseconds = static_cast<std::uint32_t>((bag_start + 4) % 1'000'000'000);
  alter(path_, bytes_of(kNanoseconds), bytes_of(kNanoseconds - 1000), 2);
  std::vector<Time> times = read();
  std::sort(times.begin(), times.end());
  EXPECT_EQ(times, all_);
  EXPECT_EQ(warnings_.count("log.damaged_chunk"), 1);
}

// Messages before the time by which the chunks are ordered would be out of order.
TEST_F(AlteredBag, MessagesBeforeTheTimeInTheIndexAreLeftOut) {
  constexpr auto kNanoseconds = static_cast<std::uint32_t>((bag_start + 4) % 1'000'000'000);
  alter(path_, bytes_of(kNanoseconds), bytes_of(kNanoseconds + 1), 2);
  EXPECT_EQ(read(), (std::vector<Time>{0, 1, 2, 3, 5, 6, 7, 8, 9}));
  EXPECT_THAT(warnings_.entries().at("log.damaged_chunk").first_detail, HasSubstr("1 messages before the time"));
}

// The length of the second chunk's content reaches over the third chunk.
TEST_F(AlteredBag, AnAlteredLengthHidesNoOtherChunk) {
  std::string bag = read_text_file(path_);
  std::size_t at = 0;
  for (int i = 0; i < 2; ++i) at = bag.find("compression=none", at + 1);
  const std::size_t size = bag.find("size=", at) + 5;
  const std::string length = bag.substr(size, 4);
  const std::size_t stated = bag.find(length, size + 4);
  ASSERT_LT(stated - size, 64U);
  bag.replace(stated, 4, bytes_of(2'000'000));
  std::ofstream(path_, std::ios::binary) << bag;
  EXPECT_EQ(read(), (std::vector<Time>{0, 1, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(warnings_.count("log.damaged_record"), 1);
}

TEST_F(AlteredBag, APlaceInTheIndexWhereNoChunkBeginsIsIgnored) {
  std::string bag = read_text_file(path_);
  const std::size_t at = bag.find("chunk_pos=", index_start()) + 10;
  bag.replace(at, 4, bytes_of(500'000));
  std::ofstream(path_, std::ios::binary) << bag;
  EXPECT_EQ(read(), all_);
}

TEST(BagIndexTest, APackedChunkWithAlteredBytesIsLost) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  {
    std::vector<std::uint8_t> bytes(400'000);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i / 7);
    BagWriter writer(path, Codec::lz4);
    for (int i = 0; i < 10; ++i) {
      writer.write("/points", bag_start + i, cloud_at(bag_start + i, bytes));
    }
    writer.close();
  }
  std::string bag = read_text_file(path);
  bag.replace(bag.size() / 2, 64, std::string(64, '\0'));
  std::ofstream(path, std::ios::binary) << bag;
  WarningLog warnings;
  BagIndex index(path, warnings);
  LoadedSegment loaded;
  std::size_t messages = 0;
  for (std::size_t i = 0; i < index.segment_count(); ++i) {
    index.load(i, loaded);
    messages += loaded.entries.size();
  }
  EXPECT_LT(messages, 10U);
  EXPECT_GE(messages, 8U);
  EXPECT_EQ(warnings.count("log.damaged_chunk"), 1);
}

TEST_F(AlteredBag, WithoutAMessageThatCanBeReadIsRefusedWithTheByte) {
  for (int i = 0; i < kMessages / 2; ++i) alter(path_, "compression=none", "compression=nine");
  EXPECT_THAT(message_of<InputError>([&] { read(); }), HasSubstr("damaged at byte"));
  alter(path_, "op=", "ap=");  // of the first record
  EXPECT_THAT(message_of<InputError>([&] { read(); }), HasSubstr("damaged at byte 13: a header has no field 'op'"));
}

}  // namespace
}  // namespace lodestone::ros1
