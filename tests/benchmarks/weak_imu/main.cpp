// Whether filter and smoother differ by more than their covariances: a Monte Carlo study over IMU grades, scan periods
// and speeds. A file keeps each finished run: an interrupted call continues when repeated.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>

#include "frontends/configuration/options.h"
#include "tests/benchmarks/weak_imu/run_table.h"
#include "tests/estimators/weak_imu/parting.h"
#include "tests/estimators/weak_imu/site.h"

namespace lodestone::weak_imu {
namespace {

struct Call {
  std::string runs_file;
  std::string reality = "exact";
  std::vector<std::string> grades;
  std::vector<double> periods_s{0.05, 0.1, 0.2, 0.5, 1.0};
  std::vector<double> speeds_m_s{0.5, 1.5, 4.0};
  int seeds = 3;
  double duration_s = 20.0;
  bool with_field = false;
  bool only_table = false;
  std::vector<std::string> settings;

  /// One word for the difference to the defaults.
  std::string variant() const {
    std::string text = with_field ? "field" : "no-field";
    for (const std::string& setting : settings) text += "," + setting;
    return text;
  }
  int threads = 0;
};

/// Result of a run; a run that ended with an error is lost and has no figures.
Comparison result_of(const Site& site, const DriveChoice& choice, const RunOptions& options) {
  const testing::Drive drive = site.drive(choice);
  try {
    return compare(drive, options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "  {}\n", error.what());
    Comparison failed;
    failed.scans = static_cast<int>(drive.bundles.size());
    for (Tracking* tracking : {&failed.filter, &failed.causal, &failed.smoothed}) {
      tracking->largest_m = tracking->rms_m = tracking->nees = tracking->largest_nees =
          std::numeric_limits<double>::quiet_NaN();
    }
    return failed;
  }
}

void simulate_and_run(const Call& call, RunTable& table) {
  RunOptions options;
  options.ieskf.deskewing_errors = true;
  load_options(load_configuration({}, call.settings), options);
  for (int seed = 1; seed <= call.seeds; ++seed) {
    std::optional<Site> site;
    for (const double speed_m_s : call.speeds_m_s) {
      for (const double period_s : call.periods_s) {
        for (const ImuGrade& grade : imu_grades()) {
          if (!call.grades.empty() && std::count(call.grades.begin(), call.grades.end(), grade.name) == 0) continue;
          const Cell cell{call.reality, call.variant(), grade.name, period_s, speed_m_s};
          if (table.has(cell, seed)) continue;
          if (!site) site.emplace(call.reality, static_cast<std::uint64_t>(seed));
          DriveChoice choice{grade, period_s, speed_m_s, call.duration_s, call.with_field};
          const auto begin = std::chrono::steady_clock::now();
          const Comparison result = result_of(*site, choice, options);
          table.add(cell, seed, result);
          const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
          fmt::print(stderr, "{} {:g} s {:g} m/s seed {}: {}, largest D2 / limit {:.2f}, {:.1f} s\n", grade.name,
                     period_s, speed_m_s, seed, result.tracked() ? "tracked" : "LOST", result.causal_parting.largest,
                     wall_s);
        }
      }
    }
  }
}

}  // namespace
}  // namespace lodestone::weak_imu

int main(int argument_count, char** arguments) {
  using namespace lodestone::weak_imu;
  Call call;
  CLI::App app{"Whether filter and smoother part by more than their covariances"};
  app.add_option("RUNS", call.runs_file, "file that keeps the finished runs, one a line")->required();
  app.add_option("--reality", call.reality, "grade of the simulator")->capture_default_str();
  app.add_option("--grades", call.grades, "of the IMU (default: all)")->delimiter(',');
  app.add_option("--periods", call.periods_s, "of the scans, s")->delimiter(',')->capture_default_str();
  app.add_option("--speeds", call.speeds_m_s, "m/s")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", call.seeds, "runs of each cell, with the seeds from 1 on")->capture_default_str();
  app.add_option("--duration", call.duration_s, "of a drive, s")->capture_default_str();
  app.add_flag("--field", call.with_field, "with magnetometers and the true field as map: ieskf against smoother");
  app.add_option("--set", call.settings, "key.path=value: an option of both estimators");
  app.add_flag("--table", call.only_table, "only print the table of the finished runs");
  app.add_option("--threads", call.threads, "at most so many (default: all)");
  CLI11_PARSE(app, argument_count, arguments);
  try {
    std::optional<tbb::global_control> limit;
    if (call.threads > 0) {
      limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(call.threads));
    }
    RunTable table(call.runs_file);
    if (!call.only_table) simulate_and_run(call, table);
    fmt::print("{}", table.markdown());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
