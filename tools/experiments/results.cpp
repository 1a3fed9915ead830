#include "tools/experiments/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/experiments/stale_figures.h"

namespace lodestone::reproduce {

namespace {

/// Adds the numbers of an object and of nested objects ("stale_map.places"), without the counts of warnings.
void add_figures(const nlohmann::json& json, const std::string& prefix, RunFigures& figures) {
  for (const auto& [key, value] : json.items()) {
    if (value.is_number()) figures[prefix + key] = value.get<double>();
    if (value.is_boolean()) figures[prefix + key] = value.get<bool>() ? 1.0 : 0.0;
    if (value.is_object() && key != "warnings") add_figures(value, prefix + key + ".", figures);
  }
}

RunFigures read_figures(const std::filesystem::path& path) {
  const auto json = nlohmann::json::parse(read_text_file(path.string()), nullptr, false);
  if (!json.is_object())
    throw InputError(fmt::format("{}: is not a JSON object; remove its folder and repeat the call", path.string()));
  RunFigures figures;
  add_figures(json, "", figures);
  return figures;
}

/// Adds the quality of a run's stale-map reports, if both maps still exist: the run's and the one of the log's scene.
void add_stale_figures(const Run& run, const std::filesystem::path& root, std::map<std::string, RunFigures>& figures) {
  const auto there = [&](const std::string& map) { return !map.empty() && std::filesystem::exists(root / map); };
  if (!run.first_seed || run.scene.empty() || !there(run.field) || !there(run.own_field)) return;
  const MagneticMap field = read_magnetic_map((root / run.field).string());
  const MagneticMap own = read_magnetic_map((root / run.own_field).string());
  for (const std::string& estimator : run.estimators) {
    const std::filesystem::path cells = root / run.folder / estimator / "field_cells.csv";
    if (std::filesystem::exists(cells)) figures[estimator].merge(stale_figures(cells, field, own));
  }
}

bool smaller_is_worse(const std::string& figure) {
  return counts_lost_runs(figure) || figure == "real_time_factor" || figure == "changed_found";
}

/// `figure` of the divisor in a run; of several estimators, the smallest of those that are not lost, or infinity.
std::optional<double> divisor_of(const Results& results, std::size_t run, const std::string& estimator,
                                 const Divisor& over, const std::string& figure) {
  if (over.estimator != kBestOfOthers) return value_of(results.find(run, over.estimator), figure);
  double best = HUGE_VAL;
  for (const std::string& other : results.runs()[run].estimators) {
    const RunFigures* figures = results.find(run, other);
    if (other == estimator || value_of(figures, "success") != 1.0) continue;
    best = std::min(best, value_of(figures, figure).value_or(HUGE_VAL));
  }
  return best;
}

}  // namespace

std::optional<double> value_of(const RunFigures* figures, const std::string& name) {
  if (figures == nullptr) return std::nullopt;
  const auto found = figures->find(name);
  return found == figures->end() ? std::nullopt : std::optional<double>(found->second);
}

bool counts_lost_runs(const std::string& figure) {
  return figure == "success" || figure.ends_with(".share_within_100mm") || figure.ends_with(".share_within_1m");
}

Results::Results(const Plan& plan, const std::filesystem::path& root, const std::vector<bool>& done)
    : runs_(plan.runs), done_(done), figures_(plan.runs.size()) {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (!done_[i]) continue;
    for (const std::string& estimator : runs_[i].estimators) {
      figures_[i][estimator] = read_figures(root / runs_[i].folder / estimator / "summary.json");
    }
    add_stale_figures(runs_[i], root, figures_[i]);
  }
  for (const MapDifference& difference : plan.differences) {
    const std::filesystem::path path = root / difference.folder / "diff.json";
    if (std::filesystem::exists(path)) differences_[difference.run] = read_figures(path);
  }
}

const RunFigures* Results::find_difference(std::size_t run) const {
  const auto found = differences_.find(runs_[run].name);
  return found == differences_.end() ? nullptr : &found->second;
}

const RunFigures* Results::find(std::size_t run, const std::string& estimator) const {
  const auto found = figures_[run].find(estimator);
  return found == figures_[run].end() ? nullptr : &found->second;
}

std::vector<std::size_t> Results::runs_of(const std::string& group, const std::string& row) const {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (runs_[i].group == group && runs_[i].row == row) indices.push_back(i);
  }
  return indices;
}

std::vector<std::string> Results::rows_of(const std::string& group) const {
  std::vector<std::string> rows;
  for (const Run& run : runs_) {
    if (run.group == group) place_of(run.row, rows);
  }
  return rows;
}

SeedValue seed_value(const Results& results, const std::string& group, const std::string& row,
                     const std::string& estimator, const std::string& figure, Statistic statistic,
                     const Divisor& over) {
  SeedValue seeds;
  std::vector<double> values;
  for (const std::size_t i : results.runs_of(group, row)) {
    const auto& estimators = results.runs()[i].estimators;
    const auto runs = [&](const std::string& name) {
      return name.empty() || name == kBestOfOthers ||
             std::find(estimators.begin(), estimators.end(), name) != estimators.end();
    };
    if (!runs(estimator) || !runs(over.estimator)) continue;
    if (is_stale_figure(figure) && !results.runs()[i].first_seed) continue;  // their maps are removed
    ++seeds.expected;
    std::optional<double> value = value_of(results.find(i, estimator), figure);
    if (value && !over.estimator.empty()) {
      const std::optional<double> other =
          divisor_of(results, i, estimator, over, over.figure.empty() ? figure : over.figure);
      value = other && *other != 0.0 ? std::optional<double>(*value / *other) : std::nullopt;
    }
    if (value_of(results.find(i, estimator), "success") == 0.0) ++seeds.lost;
    if (value) values.push_back(*value);
  }
  seeds.present = values.size();
  if (values.empty()) return seeds;
  if (statistic == Statistic::mean) {
    seeds.value = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  } else {
    seeds.value = smaller_is_worse(figure) ? *std::min_element(values.begin(), values.end())
                                           : *std::max_element(values.begin(), values.end());
  }
  return seeds;
}

}  // namespace lodestone::reproduce
