#include "tools/run/output_folder_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

class OutputFolderCheck : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& content = "mine") const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << content;
  }

  RunCall call() const {
    RunCall call;
    call.log = folder_ / "log.bag";
    call.out = folder_ / "out";
    return call;
  }

  TemporaryFolder folder_;
};

TEST_F(OutputFolderCheck, FilesThatNoRunWroteAreNotReplaced) {
  EXPECT_NO_THROW(check_output_folder(call())) << "the folder does not exist";
  write("out/notes.txt");
  write("out/pictures/mine.png");
  write("out/smoother/mine.tum");
  EXPECT_NO_THROW(check_output_folder(call())) << "no result has these names";
  for (const char* name : {"config.yaml", "call.json", "summary.json", "smoother/platform.yaml", "pictures/map.png",
                           "overview/truth.tum", "bound.csv"}) {
    write(std::string("out/") + name);
    EXPECT_THAT([&]() { check_output_folder(call()); }, testing::ThrowsMessage<InputError>(testing::HasSubstr(
                                                            (folder_ / "out").string() + "/" + name +
                                                            ": no run wrote this file, but the run would replace it")));
    std::filesystem::remove(folder_ / "out" / name);
  }
}

TEST_F(OutputFolderCheck, ResultsOfARunAreReplaced) {
  write("out/config.yaml");
  write("out/summary.json", R"({"identity": "0123456789abcdef"})");
  EXPECT_NO_THROW(check_output_folder(call()));
  std::filesystem::remove(folder_ / "out/summary.json");
  EXPECT_THROW(check_output_folder(call()), InputError);
  write("out/checkpoint/model.pt");
  EXPECT_THROW(check_output_folder(call()), InputError) << "a checkpoint of another program";
  write("out/checkpoint/call.json", "[]");
  EXPECT_NO_THROW(check_output_folder(call())) << "the run was killed";
}

TEST_F(OutputFolderCheck, OnlyInputsThatAResultReplacesAreRefused) {
  write("out/summary.json", R"({"identity": "0123456789abcdef"})");
  RunCall with_input = call();
  for (const char* name : {"out/mine.tum", "out/smoother/mine.tum"}) {
    with_input.truth = folder_ / name;
    EXPECT_NO_THROW(check_output_folder(with_input)) << name;
  }
  for (const char* name : {"out/smoother/trajectory.tum", "out/overview/truth.tum", "out/checkpoint/any.tum"}) {
    with_input.truth = folder_ / name;
    EXPECT_THROW(check_output_folder(with_input), InputError) << name;
  }
  with_input = call();
  with_input.configurations = {folder_ / "out/config.yaml"};
  EXPECT_NO_THROW(check_output_folder(with_input)) << "a run repeated with its own options";
}

}  // namespace
}  // namespace lodestone
