// The manual page and the completion, which are made from the declarations of the options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using testing::HasSubstr;
using testing::Not;

class ManualCommand : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(run_lodestone("manual --out " + folder_.path().string()).code, 0); }

  /// Completions of the last word of `line`, separated by blanks.
  std::string completed(const std::string& words, int last) const {
    const std::string script = "cd " + folder_.path().string() + " && source lodestone.bash && COMP_WORDS=(" + words +
                               ") COMP_CWORD=" + std::to_string(last) + " && _lodestone; echo \"${COMPREPLY[*]}\"";
    const std::string out = folder_ / "completed";
    EXPECT_EQ(std::system(("bash -c '" + script + "' >" + out).c_str()), 0) << words;
    return content_of(out);
  }

  TemporaryFolder folder_;
};

TEST_F(ManualCommand, ThePageHasEveryCommandWithItsOptions) {
  const std::string page = content_of(folder_ / "lodestone.1");
  EXPECT_EQ(page.rfind(".TH LODESTONE 1 ", 0), 0U);
  const std::string help = run_lodestone("--help").output;
  std::istringstream lines(help.substr(help.find("Subcommands:\n") + 13));
  int commands = 0;
  for (std::string line; std::getline(lines, line) && line.rfind("  ", 0) == 0; ++commands) {
    EXPECT_THAT(page, HasSubstr("\n.SS lodestone " + line.substr(2, line.find(' ', 2) - 2) + "\n"));
  }
  EXPECT_GE(commands, 12);
  EXPECT_THAT(page, HasSubstr("\n.SS lodestone map diff\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-platform\\fR \\fITEXT\\fR (required)\n"));
  EXPECT_THAT(page, HasSubstr("(default: [smoother])"));
  EXPECT_THAT(page, Not(HasSubstr("manual \\-\\-out"))) << "hidden";
}

TEST_F(ManualCommand, CompletesCommandsOptionsValuesAndFiles) {
  EXPECT_EQ(completed("lodestone si", 1), "simulate\n");
  EXPECT_EQ(completed("lodestone map im", 2), "import\n");
  EXPECT_EQ(completed("lodestone run a.bag --initial-pose-f", 3), "--initial-pose-from\n");
  EXPECT_EQ(completed("lodestone run a.bag --refine b", 4), "batch\n");
  EXPECT_EQ(completed("lodestone run a.bag --estimator ies", 4), "ieskf\n");
  EXPECT_EQ(completed("lodestone evaluate a.tum b.tum --align s", 5), "se3 sim3\n");
  EXPECT_EQ(completed("lodestone evaluate a.tum b.tum --relation angle,rpe-", 5), "angle,rpe-angle\n");
  EXPECT_EQ(completed("lodestone evaluate a.tum b.tum --delta-unit f", 5), "frames\n");
  EXPECT_EQ(completed("lodestone map magnetic a.bag --method c", 5), "curl-free\n");
  EXPECT_EQ(completed("lodestone map import a.csv --unit g", 5), "gauss\n");
  EXPECT_EQ(completed("lodestone simulate a.yaml --reality f", 4), "field\n");
  EXPECT_EQ(completed("lodestone run a.bag --estimator smoother,magnetic-p", 4), "smoother,magnetic-particle\n");
  EXPECT_EQ(completed("lodestone run lodestone.b", 2), "lodestone.bash\n");
  EXPECT_EQ(completed("lodestone check --initial-pose-from x --platf", 4), "--platform\n");
}

}  // namespace
}  // namespace lodestone
