#include "frontends/configuration/output_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "core/error.h"
#include "tests/tools/program_runner.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

TEST(OutputFile, AppearsOnlyWhole) {
  const TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.write("half");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  OutputFile file(folder / "a.txt");
  file.write("whole");
  file.commit();
  EXPECT_EQ(content_of(folder / "a.txt"), "whole");
  EXPECT_THROW(OutputFile(folder / "nowhere/a.txt"), InputError);
}

TEST(OutputFile, AFolderIsRefusedBeforeTheWork) {
  const TemporaryFolder folder;
  const std::string path = folder.path().string();
  EXPECT_THROW(OutputFile{folder.path()}, InputError);
  EXPECT_THROW(refuse_to_replace(path, true), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  const TemporaryFolder logs;
  const std::string log = (logs / "a.bag").string();
  std::ofstream(log) << "a log that is not read";
  for (const std::string& call :
       {"check " + log + " --out " + path, "convert " + log + " --format bag --force --out " + path}) {
    expect_refused(call, "--out " + path + ": is a folder; expected the name of a file");
  }
}

// A limit on file sizes simulates a full disk.
TEST(OutputFile, AfterAFailedWriteEachFurtherOneFailsAndNothingIsLeft) {
  const TemporaryFolder folder;
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  {
    OutputFile file(folder / "a.txt");
    const std::string large(1 << 16, 'x');
    EXPECT_THROW(file.write(large), InputError);
    EXPECT_THROW(file.write(large), InputError);
    EXPECT_THROW(file.commit(), InputError);
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, ignored);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(OutputFile, AnEmptiedFolderHasNothingOfBefore) {
  const TemporaryFolder folder;
  const std::filesystem::path tables = folder.path() / "tables";
  EXPECT_TRUE(std::filesystem::is_empty(emptied_folder(tables)));
  std::ofstream(tables / "old.csv") << "of an earlier call";
  std::filesystem::create_directory(tables / "older");
  EXPECT_TRUE(std::filesystem::is_empty(emptied_folder(tables)));
  std::ofstream(folder / "file") << "no folder";
  EXPECT_THROW(emptied_folder(folder / "file/tables"), InputError);
}

TEST(OutputFile, AYamlFileHasItsNameAndItsFolder) {
  const TemporaryFolder folder;
  EXPECT_EQ(yaml_output(folder / "new/map.yaml"), std::filesystem::path(folder / "new/map.yaml"));
  EXPECT_TRUE(std::filesystem::is_directory(folder / "new"));
  EXPECT_EQ(yaml_output("map.yaml"), "map.yaml");
  EXPECT_THROW(yaml_output(folder / "other/map.yml"), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace lodestone
