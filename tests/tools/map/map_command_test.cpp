#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;

TEST(MapCommand, HelpShowsTwoExamplesAndEveryOption) {
  const ProgramResult help = run_lodestone("map magnetic --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.output, HasSubstr("--out /tmp/tunnel/field.yaml"));
  EXPECT_THAT(help.output, HasSubstr("--out /tmp/tunnel/coarse.yaml"));
  EXPECT_THAT(help.output, HasSubstr("regression.window_points"));
  EXPECT_THAT(help.output, HasSubstr("--method curl-free"));
}

TEST(MapCommand, EachMistakeIsOneLineAndCodeTwo) {
  const TemporaryFolder folder;
  const std::string files = " --trajectory /absent.tum --platform /absent.yaml --out ";
  const std::string out = (folder / "field.yaml").string();
  const auto expect = [](const ProgramResult& result, const std::string& part) {
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.errors, HasSubstr(part));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  };
  expect(run_lodestone("map magnetic /absent.bag" + files + out), "/absent.yaml");
  expect(run_lodestone("map magnetic /absent.bag" + files + (folder / "field.txt").string()), ".yaml");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --resolution -1"),
         "--resolution: expected metres above 0, found -1");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --resolution 0"),
         "--resolution: expected metres above 0, found 0");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --max-sigma-ut -2"),
         "--max-sigma-ut: expected microtesla above 0");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --method curl-fre"), "curl-free");
  expect(run_lodestone("map magnetic /absent.bag" + files + out + " --set regresion.seed=2"),
         "did you mean 'regression'");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace lodestone
