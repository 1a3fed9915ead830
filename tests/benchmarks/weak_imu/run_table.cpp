#include "tests/benchmarks/weak_imu/run_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "tests/estimators/weak_imu/imu_grades.h"

namespace lodestone::weak_imu {

namespace {

/// Calls `act` for every figure of a run, in the order of the columns.
template <class Run, class Act>
void for_each_figure(Run& run, Act&& act) {
  for (auto* tracking : {&run.filter, &run.causal, &run.smoothed}) {
    act(tracking->rms_m);
    act(tracking->largest_m);
    act(tracking->nees);
    act(tracking->largest_nees);
  }
  for (auto* parting : {&run.causal_parting, &run.smoothed_parting}) {
    act(parting->mean);
    act(parting->largest);
    act(parting->share_above_95);
    act(parting->share_above_999);
    act(parting->hausman);
    act(parting->hausman_directions);
  }
}

std::string line_of(const Cell& cell, int seed, const Comparison& run) {
  std::string line = fmt::format("{} {} {} {:g} {:g} {} {} {} {} {}", cell.reality, cell.variant, cell.grade,
                                 cell.period_s, cell.speed_m_s, seed, run.scans, run.filter.tracked ? 1 : 0,
                                 run.causal.tracked ? 1 : 0, run.smoothed.tracked ? 1 : 0);
  for_each_figure(run, [&](double figure) { line += fmt::format(" {:.6g}", figure); });
  return line;
}

using Values = std::vector<double>;

double mean(const Values& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The largest value; NaN counts as largest.
double largest(const Values& values) {
  double result = 0.0;
  for (const double value : values) {
    if (!(value <= result)) result = value;
  }
  return result;
}

std::string row_of(const Cell& cell, const std::vector<const Comparison*>& runs) {
  const auto tracked = [&](const Tracking Comparison::*estimator) {
    return std::count_if(runs.begin(), runs.end(), [&](const Comparison* run) { return (run->*estimator).tracked; });
  };
  const auto of_each = [&](double Tracking::*figure, double scale, int digits, double (*over)(const Values&)) {
    std::string text;
    for (const Tracking Comparison::*estimator : {&Comparison::filter, &Comparison::causal, &Comparison::smoothed}) {
      Values values;
      for (const Comparison* run : runs) values.push_back((run->*estimator).*figure);
      text += fmt::format("{}{:.{}f}", text.empty() ? "" : ", ", scale * over(values), digits);
    }
    return text;
  };
  const auto of_both = [&](double Parting::*figure, double (*over)(const Values&)) {
    std::string text;
    for (const Parting Comparison::*parting : {&Comparison::causal_parting, &Comparison::smoothed_parting}) {
      Values values;
      for (const Comparison* run : runs) values.push_back((run->*parting).*figure);
      text += fmt::format("{}{:.2f}", text.empty() ? "" : ", ", over(values));
    }
    return text;
  };
  return fmt::format("| {} | {:g} | {:g} | {}, {} of {} | {} | {} | {} | {} | {} |\n", cell.grade, cell.period_s,
                     cell.speed_m_s, tracked(&Comparison::filter), tracked(&Comparison::smoothed), runs.size(),
                     of_each(&Tracking::rms_m, 1e3, 1, mean), of_each(&Tracking::nees, 1.0, 2, mean),
                     of_each(&Tracking::largest_nees, 1.0, 1, largest), of_both(&Parting::mean, mean),
                     of_both(&Parting::largest, largest));
}

}  // namespace

RunTable::RunTable(std::string path) : path_(std::move(path)) {
  std::ifstream file(path_);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::istringstream words(line);
    Cell cell;
    int seed = 0;
    Comparison run;
    words >> cell.reality >> cell.variant >> cell.grade >> cell.period_s >> cell.speed_m_s >> seed >> run.scans >>
        run.filter.tracked >> run.causal.tracked >> run.smoothed.tracked;
    // std::istream does not parse NaN.
    for_each_figure(run, [&](double& figure) {
      std::string word;
      words >> word;
      figure = std::strtod(word.c_str(), nullptr);
    });
    if (!words) throw InputError(fmt::format("{}, line {}: expected a run, found '{}'", path_, number, line));
    runs_[{cell, seed}] = run;
  }
}

void RunTable::add(const Cell& cell, int seed, const Comparison& run) {
  runs_[{cell, seed}] = run;
  std::ofstream file(path_, std::ios::app);
  file << line_of(cell, seed, run) << std::endl;
  if (!file) throw InputError(path_ + ": cannot be written");
}

std::string RunTable::markdown() const {
  std::map<std::pair<std::string, std::string>, std::map<std::string, std::map<Cell, std::vector<const Comparison*>>>>
      parts;
  for (const auto& [key, run] : runs_) {
    const Cell& cell = key.first;
    parts[{cell.reality, cell.variant}][cell.grade][cell].push_back(&run);
  }
  std::string text;
  for (auto& [part, grades] : parts) {
    text += fmt::format(
        "\nReality {}, {}:\n\n"
        "| IMU | period s | speed m/s | tracked: f, s | rms mm: f, c, s | NEES: f, c, s | largest NEES: f, c, s | "
        "mean D²: c, s | largest D²: c, s |\n|---|---|---|---|---|---|---|---|---|\n",
        part.first, part.second);
    for (const ImuGrade& grade : imu_grades()) {
      for (const auto& [cell, runs] : grades[grade.name]) text += row_of(cell, runs);
    }
  }
  return text;
}

}  // namespace lodestone::weak_imu
