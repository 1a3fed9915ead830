// A log that is read ahead: the caller sees the same at the same calls, whether a thread reads ahead or not.
#include "localization/read_ahead.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "core/error.h"
#include "core/thread_limit.h"

namespace lodestone {
namespace {

class ReadAheadTest : public ::testing::TestWithParam<int> {
 protected:
  /// Bundle `i` ends at time i; bundles 2 and 4 are warned of; bundle 6 cannot be read.
  bool read(ScanBundle& bundle) {
    bundle.scan.end = ++read_;
    if (read_ == 2 || read_ == 4) found_.add("lidar.late_scan", "scan " + std::to_string(read_), read_);
    if (read_ == 6) throw InputError("chunk 6 is cut off");
    return read_ < 8;
  }

  std::atomic<int> read_ = 0;
  WarningLog found_, warnings_;
  const ThreadLimit limit_{GetParam()};
};

TEST_P(ReadAheadTest, BundlesWarningsAndErrorsComeAtTheSameCalls) {
  ReadAhead log([this](ScanBundle& bundle) { return read(bundle); }, found_, warnings_);
  ScanBundle bundle;
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(log.next(bundle));
    EXPECT_EQ(bundle.scan.end, i);
    EXPECT_EQ(warnings_.count("lidar.late_scan"), i / 2);  // also if bundle i + 1 has been read by now
  }
  EXPECT_THROW(log.next(bundle), InputError);
  EXPECT_TRUE(log.next(bundle));  // a reader that can go on after an error does
  EXPECT_EQ(bundle.scan.end, 7);
  EXPECT_FALSE(log.next(bundle));
  const WarningLog::Entry& entry = warnings_.entries().at("lidar.late_scan");
  EXPECT_EQ(entry.first_detail, "scan 2");
  EXPECT_EQ(entry.first_time, 2);
  EXPECT_EQ(entry.last_time, 4);
}

TEST_P(ReadAheadTest, ReadsTheNextBundleWhileTheCallerWorksIfThereIsAThread) {
  ReadAhead log([this](ScanBundle& bundle) { return read(bundle); }, found_, warnings_);
  ScanBundle bundle;
  ASSERT_TRUE(log.next(bundle));
  if (usable_threads() == 1) {
    EXPECT_EQ(read_, 1);
    return;
  }
  for (int waited_ms = 0; read_ < 2 && waited_ms < 60000; ++waited_ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(read_, 2);
}

INSTANTIATE_TEST_SUITE_P(Threads, ReadAheadTest, ::testing::Values(1, 2));

}  // namespace
}  // namespace lodestone
