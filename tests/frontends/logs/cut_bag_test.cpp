// ROS 1 bags without an end are read up to the cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "frontends/configuration/text_file.h"
#include "frontends/file_bytes.h"
#include "frontends/logs/open_log.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "tests/frontends/logs/decoded_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using testing::TemporaryFolder;

constexpr Time start = 1'700'000'000'000'000'000;
constexpr int messages = 6000;

/// Two topics in turn, with numbered messages, in chunks of some hundred kilobytes.
void write_bag(const std::string& path, Codec compression) {
  ros1::BagWriter writer(path, compression);
  for (int i = 0; i < messages; ++i) {
    writer.write("/imu", start + 2 * i, ros1::ImuMessage{start + 2 * i, "imu", {1.0 * i}, {}});
    writer.write("/field", start + 2 * i + 1, ros1::MagneticFieldMessage{start + 2 * i + 1, "field", {1.0 * i}});
  }
  writer.close();
}

/// Number of messages, which must be the first ones in order; -1 otherwise.
int read_prefix(const std::string& path, std::int64_t& cut_off) {
  testing::DecodedLog log(path);
  std::int64_t listed = 0;
  std::vector<std::string> names;
  for (const TopicInfo& topic : log.topics()) {
    names.push_back(topic.name);
    listed += topic.messages;
  }
  log.select(names);
  ros1::Message message;
  std::size_t topic = 0;
  Time record_time = 0;
  int count = 0;
  for (; log.next(message, topic, record_time); ++count) {
    const bool imu = count % 2 == 0;
    if (record_time != start + count || names[topic] != (imu ? "/imu" : "/field")) return -1;
    const double number = imu ? std::get<ros1::ImuMessage>(message).angular_velocity[0]
                              : std::get<ros1::MagneticFieldMessage>(message).field_tesla[0];
    if (number != count / 2) return -1;
  }
  cut_off = log.warnings.count("log.cut_off");
  return listed == count ? count : -1;
}

class CutBagTest : public ::testing::TestWithParam<Codec> {};

TEST_P(CutBagTest, IsReadUpToTheCut) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  write_bag(path, GetParam());
  const auto size = std::filesystem::file_size(path);
  std::int64_t cut_off = 0;
  EXPECT_EQ(read_prefix(path, cut_off), 2 * messages);
  EXPECT_EQ(cut_off, 0);
  // Packed messages are read by whole chunks, of which there are five; indexes are a larger share of a packed file.
  const double all = 2.0 * messages, chunk = GetParam() == Codec::none ? 0.0 : 0.25 * all;
  for (const double share : {0.4, 0.6, 0.9}) {
    std::filesystem::copy_file(path, folder / "cut.bag", std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(folder / "cut.bag", static_cast<std::uintmax_t>(share * static_cast<double>(size)));
    const int count = read_prefix(folder / "cut.bag", cut_off);
    // In packed files, the indexes after the chunks are a large share: the cut may be within an index.
    EXPECT_LE(count, std::min((share + 0.05) * all + chunk, GetParam() == Codec::none ? all - 1.0 : all)) << share;
    EXPECT_GT(count, (share - 0.05) * all - chunk) << share;
    EXPECT_EQ(cut_off, 1);
  }
}

/// The number after `name=` in the header at `offset`, to be overwritten.
char* field(std::string& bag, std::size_t offset, const std::string& name) {
  return bag.data() + bag.find(name + "=", offset) + name.size() + 1;
}

TEST_P(CutBagTest, OfARecorderThatWasKilledGivesItsOpenChunk) {
  const TemporaryFolder folder;
  write_bag(folder / "log.bag", GetParam());
  std::string bag = read_text_file(folder / "log.bag");
  // State of a file while the recorder writes: no index yet, and zeros as the sizes of the last chunk.
  const auto number_at = [&bag](std::size_t at) {
    return std::size_t{little_endian<std::uint32_t>(reinterpret_cast<const std::uint8_t*>(bag.data()) + at)};
  };
  std::size_t last_chunk = 0, end = 0;
  for (std::size_t at = 13; at < bag.size();) {
    const std::size_t data = at + 8 + number_at(at);
    const std::size_t next = data + number_at(data - 4);
    if (*field(bag, at, "op") == 5) {
      last_chunk = at;
      end = next;
    }
    at = next;
  }
  ASSERT_GT(last_chunk, 5000U);
  std::fill_n(field(bag, 13, "index_pos"), 8, '\0');
  std::fill_n(field(bag, last_chunk, "size"), 4, '\0');
  std::fill_n(bag.data() + last_chunk + 4 + number_at(last_chunk), 4, '\0');
  std::ofstream(folder / "killed.bag.active", std::ios::binary) << bag.substr(0, end);
  std::int64_t cut_off = 0;
  EXPECT_EQ(read_prefix(folder / "killed.bag.active", cut_off), 2 * messages);
  EXPECT_EQ(cut_off, 1);
}

INSTANTIATE_TEST_SUITE_P(Compressions, CutBagTest, ::testing::Values(Codec::none, Codec::lz4, Codec::bz2),
                         [](const auto& info) {
                           return info.param == Codec::none ? "none" : info.param == Codec::lz4 ? "lz4" : "bz2";
                         });

}  // namespace
}  // namespace lodestone
