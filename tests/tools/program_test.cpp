// The command line as a whole: what is misspelt is named, with the right word where one is near.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

TEST(Program, AnUnknownOptionIsNamedBeforeWhatIsMissing) {
  expect_refused("run a.bag --estimatr smoother", "unknown option '--estimatr'; did you mean '--estimator'? (see lodestone run --help)");
  expect_refused("run a.bag --out=x --clod=y", "unknown option '--clod'; did you mean '--cloud'? (see lodestone run --help)");
  expect_refused("map magnetic --trajectry a.tum", "did you mean '--trajectory'? (see lodestone map magnetic --help)");
  expect_refused("run a.bag --wholly-made-up", "unknown option '--wholly-made-up' (see lodestone run --help)");
}

TEST(Program, AMissingOptionSendsToTheHelpOfItsOwnCommand) {
  expect_refused("run a.bag", "(see lodestone run --help)");
  expect_refused("map magnetic a.bag", "(see lodestone map magnetic --help)");
  expect_refused("map", "(see lodestone map --help)");
}

TEST(Program, AnUnknownCommandIsNamedAtEveryDepth) {
  expect_refused("rnu a.bag", "there is no command 'rnu'; did you mean 'run'? (known: simulate, ");
  expect_refused("map truht a.yaml", "there is no command 'truht' of lodestone map; did you mean 'truth'? (known: ");
  expect_refused("calibrate camera", "there is no command 'camera' of lodestone calibrate (known: magnetometers)");
}

TEST(Program, ResultsDoNotTakeThePlaceOfWhatTheyComeFrom) {
  const TemporaryFolder folder;
  const std::string truth = folder / "truth.tum";
  std::ofstream(truth) << "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n";
  const std::string content = content_of(truth);
  const std::string other = folder.path().string() + "/./truth.tum";
  for (const std::string& call : {"evaluate " + truth + " " + truth + " --errors " + truth, "evaluate " + truth + " " + truth + " --errors=" + other,
                                  "check " + truth + " --out " + truth, "map import " + truth + " --out=" + truth}) {
    expect_refused(call, "which the results would overwrite; choose another name for them");
    EXPECT_EQ(content_of(truth), content) << call;
  }
  EXPECT_EQ(run_lodestone("evaluate " + truth + " " + truth + " --errors " + (folder / "errors.csv").string()).code, 0);
  EXPECT_EQ(run_lodestone("evaluate " + truth + " " + truth + " --errors " + (folder / "errors.csv").string()).code, 0);
}

TEST(Program, ResultsDoNotTakeThePlaceOfAPartOfALog) {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string(), part = log + "/part_0.bag", samples = log + "/imu.csv";
  std::filesystem::create_directories(log);
  std::ofstream(part) << "#ROSBAG V2.0\n";
  std::ofstream(samples) << "time_s\n";
  for (const std::string& out : {part, samples}) {
    const std::string content = content_of(out);
    for (const std::string& given : {log, log + "/../log/"}) {
      expect_refused("convert " + given + " --out " + out, "is a part of " + given + ", which the results would overwrite");
      EXPECT_EQ(content_of(out), content);
    }
  }
}

TEST(Program, WhatIsNoFileIsOneLine) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  expect_refused("evaluate " + (folder / "pipe").string() + " " + (folder / "pipe").string(), "found a pipe, a device or a socket");
  expect_refused("evaluate /dev/zero /dev/zero", "found a pipe, a device or a socket");
  std::filesystem::create_symlink("loop", folder / "loop");
  expect_refused("check " + (folder / "loop").string(), "Too many levels of symbolic links");
}

}  // namespace
}  // namespace lodestone
