// An MCAP file whose recorder was killed: one chunk, without an end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontends/configuration/text_file.h"
#include "frontends/logs/log_writer.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/result_messages.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

TEST(CutMcap, TheWarningNamesTheChunkThatIsReadInPart) {
  const testing::TemporaryFolder folder;
  const TopicInfo tf = result_topic("/tf", "tf2_msgs/TFMessage");
  const auto writer = make_log_writer(folder / "whole.mcap", LogFormat::mcap, Codec::none);
  for (int i = 1; i <= 1000; ++i) {
    const auto bytes = transform_message(i * 1'000'000LL, "map", "imu", {});
    writer->write(tf, {i * 1'000'000LL, 0, bytes.data(), bytes.size()});
  }
  writer->close();
  const std::string whole = read_text_file(folder / "whole.mcap");
  const std::string path = folder / "cut.mcap";
  constexpr std::size_t kept = 60'000;
  ASSERT_GT(whole.size(), kept);
  write_text_file(path, whole.substr(0, kept));

  WarningLog warnings;
  const auto log = open_log(path, warnings);
  log->select({"/tf"});
  int messages = 0;
  for (RawMessage message; log->next(message);) ++messages;
  EXPECT_GT(messages, 300);
  EXPECT_LT(messages, 600);
  ASSERT_EQ(warnings.count("log.cut_off"), 1);
  EXPECT_EQ(warnings.entries().at("log.cut_off").first_detail,
            path +
                ": the file is cut off at byte 60000, in the chunk that begins at byte 38; the complete messages "
                "before the cut are read");
}

}  // namespace
}  // namespace lodestone
