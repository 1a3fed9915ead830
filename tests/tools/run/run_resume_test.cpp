// `lodestone run --resume` as called by users: after being killed or interrupted at any time, it gives the same bytes
// as an uninterrupted run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <set>
#include <thread>

#include "core/magnetometer/magnetic_map.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tests/tools/experiments/experiment_files.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// All results of a run, without times and memory of the machine.
std::map<std::string, std::string> results_in(const fs::path& folder) {
  static const std::set<std::string> kOfTheMachine{"wall_s", "refine_s", "work_s", "real_time_factor", "peak_rss_mb"};
  std::map<std::string, std::string> results;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::string content = content_of(entry.path());
    if (entry.path().filename() == "diagnostics.csv") {
      content = std::regex_replace(content, std::regex(",[^,\n]*\n"), "\n");  // the last column is the step's wall time
    } else if (entry.path().extension() == ".json" && entry.path().filename() != "call.json") {
      auto json = nlohmann::json::parse(content, nullptr, false);
      EXPECT_FALSE(json.is_discarded()) << entry.path();
      for (nlohmann::json* object : {&json, json.contains("estimators") ? &json["estimators"] : &json}) {
        for (const std::string& key : kOfTheMachine) {
          object->erase(key);
          for (auto& [name, inner] : object->items()) {
            if (inner.is_object()) inner.erase(key);
          }
        }
      }
      content = json.dump();
    } else if (entry.path().extension() == ".pdf") {
      const std::size_t date = content.find("/CreationDate");
      if (date != std::string::npos) content.erase(date, content.find('\n', date) - date);
    }
    results[fs::relative(entry.path(), folder).string()] = content;
  }
  return results;
}

class RunResume : public testing::Test {
 protected:
  /// A drive of three seconds through a yard, with both maps; made once.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    std::ofstream(path("yard.yaml")) << reproduce::kYard;
    const ProgramResult simulated =
        run_lodestone("simulate " + path("yard.yaml") +
                      " --sequence out --duration 3 --only log,cloud --set cloud.point_spacing_m=0.12 --out " +
                      folder_->path().string());
    ASSERT_EQ(simulated.code, 0) << simulated.errors;
    const double height_m = read_trajectory(path("truth.tum")).front().pose.position.z() - 0.08;
    const FieldGrid grid{0.1, {-5.0, -3.0}, 101, 61, {height_m}};
    const std::vector<Eigen::Vector4f> nodes(101 * 61, Eigen::Vector4f(1.0F, 2.0F, 3.0F, 0.5F));
    write_magnetic_map(MagneticMap(grid, nodes, 2.0), {}, path("like.yaml"));
    const ProgramResult mapped = run_lodestone("map truth " + path("yard.yaml") + " --like " + path("like.yaml") +
                                               " --out " + path("field.yaml"));
    ASSERT_EQ(mapped.code, 0) << mapped.errors;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }

  static std::string call(const std::string& out, const std::string& options) {
    return "run " + path("log.bag") + " --platform " + path("platform.yaml") + " --cloud " + path("cloud.pcd") +
           " --magnetic " + path("field.yaml") + " --initial-pose-from " + path("truth.tum") + " --out " + path(out) +
           " " + options;
  }

  /// Starts the call and sends `signal` when `when` returns true; returns how the call ended.
  static int broken_off(const std::string& arguments, int signal, const std::function<bool()>& when) {
    const pid_t child = fork();
    if (child == 0) {
      const std::string command = "exec " LODESTONE_PROGRAM " " + arguments + " >/dev/null 2>&1";
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    int status = 0;
    while (!when()) {
      if (waitpid(child, &status, WNOHANG) == child) return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(child, signal);
    waitpid(child, &status, 0);
    return status;
  }

  static std::function<bool()> after(double seconds) {
    const auto begin = std::chrono::steady_clock::now();
    return [=]() { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() >= seconds; };
  }

  static std::function<bool()> once_there(const std::string& file) {
    return [=]() { return fs::exists(path(file)); };
  }

  /// Duration of the uninterrupted call, s; its results are stored in `wanted`.
  static double run_unbroken(const std::string& out, const std::string& options,
                             std::map<std::string, std::string>& wanted) {
    fs::remove_all(path(out));
    const auto begin = std::chrono::steady_clock::now();
    const ProgramResult unbroken = run_lodestone(call(out, options));
    EXPECT_EQ(unbroken.code, 0) << unbroken.errors;
    wanted = results_in(path(out));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  static void expect_same(const std::map<std::string, std::string>& found,
                          const std::map<std::string, std::string>& wanted) {
    for (const auto& [name, content] : found) EXPECT_TRUE(wanted.contains(name)) << name;
    for (const auto& [name, content] : wanted) {
      ASSERT_TRUE(found.contains(name)) << name;
      EXPECT_TRUE(found.at(name) == content) << name;
    }
  }

  static TemporaryFolder* folder_;
};

TemporaryFolder* RunResume::folder_ = nullptr;

TEST_F(RunResume, KilledTwentyTimesItEndsWithTheSameBytes) {
  const std::string options = "--estimator smoother,ieskf,lidar-inertial --refine batch --set smoother.window_s=1";
  std::map<std::string, std::string> wanted;
  const double whole_s = run_unbroken("unbroken", options, wanted);
  std::mt19937_64 random(5);
  int kept = 0;
  // Calls are killed repeatedly, each a third of a whole run later on average, until one finishes.
  int kills = 0;
  while (kills < 20) {
    fs::remove_all(path("killed"));
    std::string resume;
    for (; kills < 20; ++kills) {
      const double after_s = whole_s * static_cast<double>(random() % 1000) / 1500.0;
      const int status = broken_off(call("killed", options + resume), SIGKILL, after(after_s));
      if (fs::exists(path("killed/checkpoint/smoother.estimates"))) ++kept;
      resume = " --resume";
      if (WIFEXITED(status)) break;
    }
    const ProgramResult resumed = run_lodestone(call("killed", options + " --resume"));
    ASSERT_EQ(resumed.code, 0) << resumed.errors;
    expect_same(results_in(path("killed")), wanted);
  }
  EXPECT_GT(kept, 0);
  EXPECT_FALSE(fs::exists(path("killed/checkpoint")));
}

TEST_F(RunResume, InterruptedItKeepsWhatHadEnded) {
  const std::string options = "--estimator ieskf,smoother --refine batch --truth " + path("truth.tum");
  std::map<std::string, std::string> wanted;
  run_unbroken("unbroken", options, wanted);
  int status = 0;
  for (int attempt = 0; attempt < 5; ++attempt) {  // on a busy machine, the call may finish before the signal
    fs::remove_all(path("interrupted"));
    status = broken_off(call("interrupted", options), SIGINT, once_there("interrupted/checkpoint/ieskf.estimates"));
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) != 0) break;
  }
  ASSERT_EQ(WEXITSTATUS(status), 130);
  EXPECT_EQ(nlohmann::json::parse(content_of(path("interrupted/summary.json")))["status"], "interrupted");
  EXPECT_THAT(content_of(path("interrupted/smoother/causal.tum")), HasSubstr("# interrupted"));
  EXPECT_FALSE(fs::exists(path("interrupted/checkpoint/smoother.estimates")));
  const ProgramResult resumed = run_lodestone(call("interrupted", options + " --resume"));
  ASSERT_EQ(resumed.code, 0) << resumed.errors;
  EXPECT_THAT(resumed.output, HasSubstr("ieskf: finished; its estimates are kept"));
  EXPECT_THAT(resumed.output, Not(HasSubstr("smoother: finished")));
  expect_same(results_in(path("interrupted")), wanted);
}

TEST_F(RunResume, SaysWhatItFinds) {
  const std::string options = "--estimator ieskf";
  const ProgramResult anew = run_lodestone(call("whole", options + " --resume"));
  EXPECT_EQ(anew.code, 0) << anew.errors;
  EXPECT_THAT(anew.output, HasSubstr("nothing to resume"));
  const ProgramResult whole = run_lodestone(call("whole", options + " --resume"));
  EXPECT_EQ(whole.code, 0) << whole.errors;
  EXPECT_THAT(whole.output, HasSubstr("the results are complete"));
}

TEST_F(RunResume, FinishedResultsOfAnotherCallStay) {
  const std::string options = "--estimator ieskf";
  std::map<std::string, std::string> wanted;
  run_unbroken("finished", options, wanted);
  expect_refused(call("finished", options + " --resume --max-range 20"), "--max-range was none and is 20 now");
  expect_refused(call("finished", "--estimator smoother --resume"), "--estimator was ieskf and is smoother now");
  EXPECT_EQ(results_in(path("finished")), wanted);
  // Without the identity in full, the digest in summary.json still shows that the call is another.
  fs::remove(path("finished/call.json"));
  expect_refused(call("finished", options + " --resume --max-range 20"), "the results are of another call");
  EXPECT_THAT(run_lodestone(call("finished", options + " --resume")).output, HasSubstr("the results are complete"));
}

TEST_F(RunResume, RefusesResultsOfAnotherCall) {
  const std::string options = "--estimator ieskf,smoother";
  std::map<std::string, std::string> wanted;
  run_unbroken("unbroken", options, wanted);
  const std::string recording = path("refused/checkpoint/ieskf.estimates");
  for (int attempt = 0; attempt < 5 && !fs::exists(recording); ++attempt) {
    broken_off(call("refused", options), SIGKILL, once_there("refused/checkpoint/ieskf.estimates"));
  }
  ASSERT_TRUE(fs::exists(recording));
  expect_refused(call("refused", options + " --resume --set smoother.window_s=1.5"),
                 "smoother.window_s was 2.5 and is 1.5 now");
  expect_refused(call("refused", options + " --resume --max-range 25"), "--max-range was none and is 25 now");
  expect_refused(call("refused", "--estimator smoother --resume"),
                 "--estimator was ieskf,smoother and is smoother now");
  const auto changed = fs::last_write_time(path("log.bag"));
  fs::last_write_time(path("log.bag"), changed + std::chrono::seconds(1));
  expect_refused(call("refused", options + " --resume"), "the log was");
  fs::last_write_time(path("log.bag"), changed);

  const auto write = [](const std::string& file, const std::string& content) {
    std::ofstream(file, std::ios::binary) << content;
  };
  const std::string identity = content_of(path("refused/checkpoint/call.json"));
  write(path("refused/checkpoint/call.json"), identity.substr(0, identity.size() / 2));
  expect_refused(call("refused", options + " --resume"), "call.json: the file is damaged");
  write(path("refused/checkpoint/call.json"), identity);

  // An estimator with a damaged recording is run again.
  const std::string whole = content_of(recording);
  write(recording, whole.substr(0, whole.size() / 2));
  const ProgramResult resumed = run_lodestone(call("refused", options + " --resume"));
  ASSERT_EQ(resumed.code, 0) << resumed.errors;
  EXPECT_THAT(resumed.output, HasSubstr("no estimator has finished"));
  expect_same(results_in(path("refused")), wanted);
}

TEST_F(RunResume, WithoutTheWordItBeginsAnew) {
  fs::create_directories(path("anew/checkpoint"));
  std::ofstream(path("anew/checkpoint/ieskf.estimates")) << "of old";
  // Temporary files of a killed process.
  const std::vector<std::string> aside{"anew/bound.csv.partial-7", "anew/ieskf/trajectory.tum.partial-7",
                                       "anew/pictures/map.png.partial-7", "anew/overview/truth.tum.partial-7"};
  for (const std::string& file : aside) {
    fs::create_directories(fs::path(path(file)).parent_path());
    std::ofstream(path(file)) << "half";
  }
  const ProgramResult result = run_lodestone(call("anew", "--estimator ieskf"));
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_FALSE(fs::exists(path("anew/checkpoint")));
  for (const std::string& file : aside) EXPECT_FALSE(fs::exists(path(file))) << file;
}

}  // namespace
}  // namespace lodestone
