// `lodestone reproduce` as called by users, in a yard that takes seconds.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/tools/experiments/experiment_files.h"

namespace lodestone::reproduce {
namespace {

using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

class ReproduceCommand : public testing::Test {
 protected:
  void SetUp() override { experiment_ = write_yard(folder_); }

  ProgramResult reproduce(const std::string& out, const std::string& options = "") const {
    return run_lodestone("reproduce " + experiment_ + " --out " + (folder_ / out).string() + " " + options);
  }

  /// Every table of an output folder, by name, without times.
  std::map<std::string, std::string> tables(const std::string& out) const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_ / out / "tables")) {
      if (entry.path().filename() != "runs.csv") all[entry.path().filename()] = content_of(entry.path());
    }
    return all;
  }

  /// Starts the program, sends SIGINT once `file` is there, and expects the exit code of an interrupted command.
  void interrupt_once_there(const std::string& out, const std::string& options, const std::string& file) const {
    const std::string command = std::string("exec ") + LODESTONE_PROGRAM + " reproduce " + experiment_ + " --out " +
                                (folder_ / out).string() + " --jobs 2 " + options + " >/dev/null 2>&1";
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      std::terminate();
    }
    int status = 0;
    const auto begin = std::chrono::steady_clock::now();
    while (!fs::exists(folder_ / out / file) && waitpid(child, &status, WNOHANG) == 0 &&
           std::chrono::steady_clock::now() - begin < std::chrono::minutes(5)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_TRUE(fs::exists(folder_ / out / file));
    kill(child, SIGINT);
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << status;
  }

  static std::string steps_to_do(const ProgramResult& result) {
    const std::size_t end = result.errors.find(" steps to do");
    const std::size_t begin = result.errors.rfind(' ', end - 1);
    return result.errors.substr(begin + 1, end - begin - 1);
  }

  /// Logs and clouds are removed, except for the thinned cloud of a run's overview; magnetic maps that a figure shows
  /// may remain.
  void expect_no_logs(const std::string& out) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / out)) {
      if (entry.path().parent_path().filename() == "overview") continue;
      const std::string ending = entry.path().extension();
      EXPECT_TRUE(ending != ".bag" && ending != ".pcd") << entry.path();
    }
  }

  TemporaryFolder folder_;
  std::string experiment_;
};

TEST_F(ReproduceCommand, RunsWhatIsMissingSkipsWhatIsDoneAndGoesOnAfterAnInterruption) {
  // Interrupted in the middle: finished steps are kept, unfinished ones are repeated.
  const std::string first_seed = "--seeds 1";
  interrupt_once_there("out", first_seed, "runs/ways/yard-out-30m/seed1/step.json");
  const ProgramResult resumed = reproduce("out", first_seed + " --jobs 2");
  ASSERT_EQ(resumed.code, 0) << resumed.errors;
  const ProgramResult whole = reproduce("whole", first_seed + " --jobs 1");
  ASSERT_EQ(whole.code, 0) << whole.errors;
  EXPECT_LT(std::stoi(steps_to_do(resumed)), std::stoi(steps_to_do(whole)));
  EXPECT_EQ(tables("out"), tables("whole"));
  EXPECT_EQ(tables("out").size(), 3U * 3U);

  expect_no_logs("out");
  for (const char* figure : {"error", "distribution", "changes", "worlds"}) {
    for (const char* ending : {".png", ".pdf", ".svg"}) {
      EXPECT_TRUE(fs::exists(folder_ / "out/figures" / (std::string(figure) + ending))) << figure << ending;
    }
  }
  EXPECT_GT(fs::file_size(folder_ / "out/report.html"), 100'000U);
  const auto json = nlohmann::json::parse(content_of(folder_ / "out/reproduce.json"));
  ASSERT_EQ(json["runs"].size(), 4U);
  for (const auto& run : json["runs"]) {
    EXPECT_EQ(run["status"], "done");
    for (const auto& estimator : run["estimators"]) {
      EXPECT_TRUE(fs::exists(folder_ / "out" / run["folder"].get<std::string>() / estimator.get<std::string>() /
                             "summary.json"));
    }
  }
  EXPECT_EQ(json["tables"].size(), 3U);
  EXPECT_THAT(content_of(folder_ / "out/tables/criteria.md"), HasSubstr("| reaches the end | 2 of 2, 2 wanted |"));

  // The map of the log's own day does not differ from itself; the cart of the other day is found.
  const auto days = json["tables"][1]["rows"];
  EXPECT_EQ(std::stod(days[0][3].get<std::string>()), 0.0);
  EXPECT_GT(std::stod(days[1][3].get<std::string>()), 0.1);

  // Nothing to do; then, after a change of the world, everything.
  const auto before = tables("out");
  const ProgramResult again = reproduce("out", first_seed);
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(steps_to_do(again), "0");
  EXPECT_EQ(tables("out"), before);
  std::ofstream(folder_ / "yard.yaml", std::ios::app) << "\ngravity_m_s2: 9.81\n";
  const ProgramResult changed = reproduce("out", "--only ways/yard-out-5m/seed2");
  EXPECT_EQ(changed.code, 0) << changed.errors;
  EXPECT_EQ(steps_to_do(changed), "4");  // cloud, log, field, run
}

TEST_F(ReproduceCommand, QuickAndOnlyShortenIt) {
  const ProgramResult result = reproduce("quick", "--quick");
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(steps_to_do(result), "4");
  EXPECT_THAT(content_of(folder_ / "quick/logs/yard-out-seed1-log.log"), HasSubstr("--duration 3"));
}

TEST_F(ReproduceCommand, AFailingStepIsOneLineAndTheOthersGoOn) {
  std::string text = kYardExperiment;
  text.replace(text.find("    seeds: first\ntables"), 16, "    seeds: first\n    run_settings: [no.such.key=1]");
  std::ofstream(folder_ / "experiment.yaml") << text;
  const ProgramResult result = reproduce("out", "--only ways/yard-out-30m/seed1,days/yard-back-none");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("days/yard-back-none/seed1: exit code 2: "));
  EXPECT_THAT(result.errors, HasSubstr("unknown key"));
  EXPECT_THAT(result.errors, HasSubstr("logs/days_yard-back-none_seed1.log"));
  const auto json = nlohmann::json::parse(content_of(folder_ / "out/reproduce.json"));
  for (const auto& run : json["runs"]) EXPECT_EQ(run["status"], run["group"] == "ways" ? "done" : "failed");
  expect_no_logs("out");
}

TEST_F(ReproduceCommand, RefusesWrongCallsInOneLine) {
  const std::string out = " --out " + (folder_ / "out").string();
  expect_refused("reproduce nothing" + out, "there is no experiment 'nothing'");
  expect_refused("reproduce " + (folder_ / "nowhere.yaml").string() + out, "nowhere.yaml");
  expect_refused("reproduce " + experiment_, "--out");
  expect_refused("reproduce " + experiment_ + out + " --only wys", "did you mean 'ways'?");
  expect_refused("reproduce " + experiment_ + out + " --jobs 0", "--jobs");
  expect_refused("reproduce " + experiment_ + out + " --seeds 1,1", "--seeds");
  std::string text = kYardExperiment;
  text.replace(text.find("sequences: [out]"), 16, "sequences: [uot]");
  text.erase(text.find("    published:"), text.find("  days:") - text.find("    published:"));
  text.erase(text.find("tables:"), text.find("quick:") - text.find("tables:"));
  std::ofstream(folder_ / "experiment.yaml") << text;
  expect_refused("reproduce " + experiment_ + out + " --only ways", "there is no sequence 'uot'");
  fs::remove(folder_ / "yard.yaml");
  expect_refused("reproduce " + experiment_ + out, "yard.yaml");
  expect_refused("reproduce " + experiment_ + " --list", "yard.yaml");
}

TEST_F(ReproduceCommand, ListsItsRunsAndShowsExamples) {
  const ProgramResult list = run_lodestone("reproduce " + experiment_ + " --list --only ways --seeds 7");
  EXPECT_EQ(list.code, 0) << list.errors;
  EXPECT_THAT(list.output, HasSubstr("ways/yard-out-5m/seed7"));
  EXPECT_THAT(list.output, Not(HasSubstr("days")));
  EXPECT_THAT(run_lodestone("reproduce --help").output, HasSubstr("lodestone reproduce paper --quick"));
}

}  // namespace
}  // namespace lodestone::reproduce
