// Output on a terminal while a command runs: progress, interrupt, table.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>

#include "core/error.h"
#include "tools/progress.h"
#include "tools/table.h"

namespace lodestone {
namespace {

TEST(Progress, SaysShareRateAndTimeLeft) {
  EXPECT_EQ(progress_line("smoother", 0.5, 6.04, 83.0, 4), "smoother  ██░░   50 %  6.0 x real time  1:23 left");
  EXPECT_EQ(progress_line("ieskf", 0.999, 10.0, 3725.0, 0), "ieskf   99 %  10.0 x real time  1:02:05 left");
  EXPECT_EQ(progress_line("ieskf", 1.2, 1.0, std::nan(""), 0), "ieskf  100 %  1.0 x real time");
}

TEST(Progress, IsSilentForShortRunsThatNobodyWatches) {
  testing::internal::CaptureStderr();
  {
    Progress progress("smoother", 0, from_seconds(10.0));
    for (int i = 0; i <= 10; ++i) progress.update(from_seconds(i));
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(InterruptDeathTest, FirstSignalAsksSecondEnds) {
  EXPECT_EXIT(
      {
        catch_interrupts();
        throw_if_interrupted();
        std::raise(SIGTERM);
        bool asked = false;
        try {
          throw_if_interrupted();
        } catch (const Interrupted&) {
          asked = interrupt_requested();
        }
        std::exit(asked ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EXIT(
      {
        catch_interrupts();
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(Table, AlignsColumnsByWhatIsSeen) {
  Table table({"name", "σ"});
  table.add({"a", "1.00"});
  table.add({"long name", fixed(std::nan(""), 2)});
  EXPECT_EQ(table.to_string(), "name          σ\n─────────  ────\na          1.00\nlong name     –\n");
}

}  // namespace
}  // namespace lodestone
