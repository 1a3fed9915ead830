// Logs packed with zstd, as a whole or message by message.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <optional>

#include "frontends/configuration/text_file.h"
#include "tests/frontends/logs/stored_messages.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using ::testing::Not;
using testing::raw_message;
using ::testing::StartsWith;
using testing::store_as;
using testing::stored_messages;
using testing::SyntheticLog;
using testing::TemporaryFolder;

std::string zstd_of(const std::string& bytes) {
  const auto packed = pack(Codec::zstd, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  return {packed.begin(), packed.end()};
}

void store_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Sets the folder of temporary files during its lifetime.
class TemporaryFilesIn {
 public:
  explicit TemporaryFilesIn(const std::string& folder) {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    fs::create_directories(folder);
    ::setenv("TMPDIR", folder.c_str(), 1);
  }
  ~TemporaryFilesIn() {
    if (before_) {
      ::setenv("TMPDIR", before_->c_str(), 1);
    } else {
      ::unsetenv("TMPDIR");
    }
  }

 private:
  std::optional<std::string> before_;
};

/// An MCAP file of a few scans, and its bytes.
class PackedLog : public ::testing::Test {
 protected:
  void SetUp() override {
    log_.scans = 3;
    log_.points_per_scan = 512;
    log_.write(folder_ / "log.bag");
    store_as(folder_ / "log.bag", plain_, LogFormat::mcap);
  }
  std::vector<testing::StoredMessage> messages_in(const std::string& path) {
    warnings_ = {};
    const auto source = open_log(path, warnings_);
    return stored_messages(*source);
  }

  TemporaryFolder folder_;
  SyntheticLog log_;
  std::string plain_ = folder_ / "log.mcap";
  WarningLog warnings_;
};

/// As written by rosbag2 with compression_mode MESSAGE: chunks are plain, each message is a frame.
TEST_F(PackedLog, IsReadWhenEachMessageOfAnMcapFileIsPacked) {
  const auto expected = messages_in(plain_);
  ASSERT_GT(expected.size(), 50U);
  WarningLog ignored;
  const auto source = open_log(plain_, ignored);
  const auto write = [&](const std::string& path, std::size_t damaged) {
    const auto writer = make_log_writer(path, LogFormat::mcap, Codec::none);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      for (const TopicInfo& topic : source->topics()) {
        if (topic.name != expected[i].topic) continue;
        std::string frame = zstd_of(expected[i].bytes);
        if (i == damaged) frame.resize(frame.size() / 2);
        writer->write(topic, raw_message(expected[i].time, frame));
      }
    }
    writer->close();
  };
  write(folder_ / "packed.mcap", expected.size());
  EXPECT_TRUE(messages_in(folder_ / "packed.mcap") == expected);
  EXPECT_TRUE(warnings_.entries().empty());

  write(folder_ / "damaged.mcap", 7);
  const auto damaged = open_log(folder_ / "damaged.mcap", warnings_);
  for (int reading = 0; reading < 2; ++reading) EXPECT_EQ(stored_messages(*damaged).size(), expected.size() - 1);
  EXPECT_EQ(warnings_.count("log.damaged_message"), 1) << "the second reading must not count it again";
}

TEST_F(PackedLog, IsToldByWhatComesOutOfSmallFrames) {
  const std::string bytes = read_text_file(plain_);
  std::string frames;
  for (std::size_t at = 0; at < 40; at += 4) frames += zstd_of(bytes.substr(at, 4));
  store_bytes(folder_ / "frames", frames + zstd_of(bytes.substr(40)));
  EXPECT_TRUE(messages_in(folder_ / "frames") == messages_in(plain_));
}

TEST_F(PackedLog, IsRefusedBeforeAnythingElseIsUnpacked) {
  const std::string path = folder_ / "zeros.zst", out = folder_ / "out";
  store_bytes(path, zstd_of(std::string(std::size_t{8} << 20, '\0')));
  std::size_t seen = 0;
  const auto refuse = [&](std::span<const std::uint8_t> begin) {
    seen = begin.size();
    throw InputError("refused");
  };
  EXPECT_EQ(message_of<InputError>([&] { unpack_zstd_file(path, out, 1U << 30, refuse); }), "refused");
  EXPECT_GE(seen, 16U);
  EXPECT_EQ(fs::file_size(out), 0U);
  WarningLog warnings;
  EXPECT_THAT(message_of<InputError>([&] { open_log(path, warnings); }),
              AllOf(StartsWith(path + ": its zstd compression contains no log"), Not(HasSubstr("lodestone-"))));
  store_bytes(path, zstd_of(zstd_of(read_text_file(plain_))));
  EXPECT_THAT(message_of<InputError>([&] { open_log(path, warnings); }),
              StartsWith(path + ": is packed with zstd twice"));
}

TEST_F(PackedLog, TakesNoMoreOfTheDiskThanThereIsRoomFor) {
  const std::string path = folder_ / "zeros.zst", out = folder_ / "out";
  store_bytes(path, zstd_of(std::string(std::size_t{8} << 20, '\0')));
  const auto accept = [](std::span<const std::uint8_t>) {};
  constexpr std::uint64_t room = 2'000'000;
  EXPECT_THAT(message_of<InputError>([&] { unpack_zstd_file(path, out, room, accept); }),
              AllOf(StartsWith(path + ": the unpacked log exceeds the 2.0 MB that "), HasSubstr("set TMPDIR")));
  EXPECT_LE(fs::file_size(out), room);
  unpack_zstd_file(path, out, std::uint64_t{8} << 20, accept);
  EXPECT_EQ(fs::file_size(out), std::size_t{8} << 20);
}

TEST_F(PackedLog, IsNamedAsItWasGiven) {
  const std::string bytes = read_text_file(plain_), path = folder_ / "cut.mcap.zst";
  store_bytes(path, zstd_of(bytes.substr(0, bytes.size() * 6 / 10)));
  EXPECT_FALSE(messages_in(path).empty());
  ASSERT_EQ(warnings_.count("log.cut_off"), 1);
  EXPECT_THAT(warnings_.entries().at("log.cut_off").first_detail, StartsWith(path + ": "));
  store_bytes(path, zstd_of(bytes.substr(0, 8)));
  EXPECT_THAT(message_of<InputError>([&] { messages_in(path); }),
              StartsWith(path + ": the file is cut off or damaged at byte 8"));
}

TEST_F(PackedLog, ClearsAwayOnlyWhatAKilledProcessOfOursHasLeft) {
  const std::string path = folder_ / "log.mcap.zst", temporary = folder_ / "tmp";
  store_bytes(path, zstd_of(read_text_file(plain_)));
  const TemporaryFilesIn guard(temporary);
  const auto put = [&](const std::string& name, bool old) {
    store_bytes(temporary + "/" + name, "x");
    if (old) fs::last_write_time(temporary + "/" + name, fs::file_time_type::clock::now() - std::chrono::hours(72));
  };
  // No process has such an id: Linux assigns at most 4194304.
  const std::string leftover = "lodestone-4999999-AbCd12", young = "lodestone-4999999-AbCd13",
                    link = "lodestone-4999999-AbCd14";
  const std::vector<std::string> strangers{"lodestone-2025.txt",
                                           "lodestone-2026-01-05.mcap.zstd",
                                           "lodestone-4999999-reports",
                                           "lodestone-4999999-AbCd1",
                                           "lodestone-4999999-AbCd12.mcap",
                                           "lodestone-4999999-Ab.d12",
                                           "lodestone-4999999x-AbCd1",
                                           "lodestone--AbCd12",
                                           "my-lodestone-4999999-AbCd12"};
  put(leftover, true);
  put(young, false);
  for (const std::string& name : strangers) put(name, true);
  fs::create_symlink(temporary + "/" + strangers.front(), temporary + "/" + link);
  const timespec long_ago[2] = {{1'000'000'000, 0}, {1'000'000'000, 0}};
  ASSERT_EQ(::utimensat(AT_FDCWD, (temporary + "/" + link).c_str(), long_ago, AT_SYMLINK_NOFOLLOW), 0);
  EXPECT_FALSE(messages_in(path).empty());
  EXPECT_FALSE(fs::exists(temporary + "/" + leftover));
  EXPECT_TRUE(fs::exists(temporary + "/" + young));
  EXPECT_TRUE(fs::is_symlink(temporary + "/" + link));
  for (const std::string& name : strangers) EXPECT_TRUE(fs::exists(temporary + "/" + name)) << name;
}

}  // namespace
}  // namespace lodestone
