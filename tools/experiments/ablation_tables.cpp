#include "tools/experiments/ablation_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "tools/experiments/switches.h"
#include "tools/simulate/world_queries.h"

namespace lodestone::ablation {

namespace {

using reproduce::kLost;
using reproduce::kMissing;
using reproduce::kNothing;
using reproduce::number_cell;
using reproduce::ResultTable;
using reproduce::RunFigures;

constexpr const char* kFigure = "ate_m";

constexpr const char* kSummaryNote =
    "Ratios are variant over baseline, geometric means over pairs of runs (the same drive, range and seed) in which "
    "neither lost "
    "track, with Student's 95 % interval; over drives: each drive's seeds as one. Lost: runs more than 1 m off at any "
    "time, or "
    "not at the end; losing track alone counts as worse.";

std::string ratio_text(const std::optional<RatioEstimate>& estimate) {
  return estimate ? fmt::format("{:.3f}", estimate->ratio) : kNothing;
}

std::string interval_text(const std::optional<RatioEstimate>& estimate) {
  if (!estimate || !estimate->low) return kNothing;
  return fmt::format("{:.3f} – {:.3f}", *estimate->low, *estimate->high);
}

/// Names of all figures of all runs.
std::set<std::string> figures_in(const reproduce::Results& results) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < results.runs().size(); ++i) {
    const RunFigures* figures = results.find(i, results.runs()[i].estimators.front());
    if (figures == nullptr) continue;
    for (const auto& [name, value] : *figures) names.insert(name);
  }
  return names;
}

std::vector<std::string> drives_of(const reproduce::Results& results) {
  std::vector<std::string> drives;
  for (const reproduce::Run& run : results.runs()) {
    reproduce::place_of(drive_name(run), drives);
  }
  return drives;
}

std::vector<Pair> of_drive(const std::vector<Pair>& pairs, const std::string& drive) {
  std::vector<Pair> some;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(some),
               [&](const Pair& pair) { return pair.drive == drive; });
  return some;
}

/// ATE of the baseline itself, metres.
std::string baseline_cell(const std::vector<Pair>& pairs) {
  if (std::none_of(pairs.begin(), pairs.end(), [](const Pair& pair) { return pair.variant != nullptr; }))
    return kMissing;
  const bool lost = std::any_of(pairs.begin(), pairs.end(),
                                [](const Pair& pair) { return pair.variant != nullptr && is_lost(*pair.variant); });
  const std::optional<double> ate = geometric_mean(pairs, kFigure);
  return lost ? kLost : ate ? fmt::format("{:.4f} m", *ate) : kNothing;
}

std::string ratio_cell(const std::vector<Pair>& pairs) {
  const Comparison comparison = compare_pairs(pairs, kFigure);
  if (comparison.done == 0) return kMissing;
  if (comparison.lost > 0) return kLost;
  return ratio_text(comparison.over_pairs);
}

/// Names of all figures of all runs: the well-known ones first, then the rest alphabetically.
std::vector<std::string> figures_of(const reproduce::Results& results) {
  std::set<std::string> there = figures_in(results);
  std::vector<std::string> names;
  for (const std::string& name : reproduce::figure_names()) {
    if (there.erase(name) > 0) names.push_back(name);
  }
  names.insert(names.end(), there.begin(), there.end());
  return names;
}

/// Field noise of each world's own magnetometers, read once per world.
class WorldNoise {
 public:
  double of(const std::string& world, const std::vector<std::string>& settings) {
    const auto [found, is_new] = noise_ut_.try_emplace({world, settings}, 0.0);
    if (is_new) found->second = simulation::magnetometer_noise_ut(world, settings);
    return found->second;
  }

 private:
  std::map<std::pair<std::string, std::vector<std::string>>, double> noise_ut_;
};

}  // namespace

ResultTable summary_table(const Ablation& ablation, const reproduce::Results& results) {
  const std::string& baseline = ablation.variants[ablation.baseline].name;
  ResultTable table{ablation.name, ablation.title, {}, {}, fmt::format("Baseline: {}. {}", baseline, kSummaryNote)};
  if (!ablation.note.empty()) table.note += " " + ablation.note;
  table.header = {"variant",          "pairs",  "lost",  "ATE m", "ATE ratio",           "95 %",
                  "95 % over drives", "better", "worse", "equal", "largest error ratio", "largest jump ratio",
                  "heading ratio"};
  std::set<std::string> nees = figures_in(results);
  std::erase_if(nees, [](const std::string& name) { return !name.starts_with("nees"); });
  for (const std::string& name : nees) table.header.push_back(name == "nees_pose" ? "NEES" : name);
  table.header.emplace_back("time ratio");
  for (std::size_t i = 0; i < ablation.variants.size(); ++i) {
    const std::vector<Pair> pairs = pairs_of(ablation, ablation.variants[i], results);
    if (pairs.empty()) continue;  // not selected by this call
    const Comparison ate = compare_pairs(pairs, kFigure);
    const auto ratio = [&](const char* figure) { return ratio_text(compare_pairs(pairs, figure).over_pairs); };
    const bool own = i == ablation.baseline;
    std::vector<std::string> row{
        ablation.variants[i].name,
        ate.done < ate.pairs ? fmt::format("{} of {}", ate.done, ate.pairs) : fmt::format("{}", ate.pairs),
        fmt::format("{}", ate.lost), number_cell(geometric_mean(pairs, kFigure), 4)};
    if (own) {
      row.insert(row.end(), {"baseline", "", "", "", "", "", "", "", ""});
    } else if (ate.done == 0) {
      row.insert(row.end(), 9, kMissing);
    } else {
      row.insert(row.end(), {ratio_text(ate.over_pairs), interval_text(ate.over_pairs), interval_text(ate.over_drives),
                             fmt::format("{}", ate.better), fmt::format("{}", ate.worse), fmt::format("{}", ate.equal),
                             ratio("max_error_m"), ratio("stages.causal.largest_jump_m"), ratio("heading_rmse_deg")});
    }
    for (const std::string& name : nees) row.push_back(number_cell(geometric_mean(pairs, name), 2));
    row.push_back(own ? "" : ate.done == 0 ? kMissing : ratio("wall_s"));
    table.rows.push_back(std::move(row));
  }
  return table;
}

ResultTable drives_table(const Ablation& ablation, const reproduce::Results& results) {
  ResultTable table{
      ablation.name + "-drives",
      ablation.title + ", drive by drive",
      {"variant"},
      {},
      "ATE of the baseline in metres, of the others its ratio to it: geometric means over the seeds. /: lost with some "
      "seed; -: lost by the baseline."};
  const std::vector<std::string> drives = drives_of(results);
  table.header.insert(table.header.end(), drives.begin(), drives.end());
  for (std::size_t i = 0; i < ablation.variants.size(); ++i) {
    const std::vector<Pair> pairs = pairs_of(ablation, ablation.variants[i], results);
    if (pairs.empty()) continue;
    std::vector<std::string> row{ablation.variants[i].name};
    for (const std::string& drive : drives) {
      const std::vector<Pair> some = of_drive(pairs, drive);
      row.push_back(some.empty() ? kMissing : i == ablation.baseline ? baseline_cell(some) : ratio_cell(some));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

ResultTable tidy_table(const Ablation& ablation, const reproduce::Results& results,
                       const std::vector<std::string>& status) {
  ResultTable table{ablation.name + "-runs", ablation.title, {"ablation", "variant", "baseline", "estimator"}, {}, ""};
  std::vector<std::string> keys = ablation.keys();
  std::erase_if(keys,
                [](const std::string& key) { return key == "noise_ut" || key == "estimator"; });  // have own columns
  table.header.insert(table.header.end(), keys.begin(), keys.end());
  for (const char* name : {"world", "sequence", "scene", "range_m", "noise_ut", "seed", "status"})
    table.header.emplace_back(name);
  const std::vector<std::string> figures = figures_of(results);
  table.header.insert(table.header.end(), figures.begin(), figures.end());
  table.header.emplace_back("folder");
  WorldNoise noise;
  for (std::size_t v = 0; v < ablation.variants.size(); ++v) {
    const Variant& variant = ablation.variants[v];
    const std::string group = recipe_name(ablation, variant);
    const std::vector<std::string> settings = sort_switches(variant.switches).world;
    std::vector<std::string> values;
    for (const std::string& key : keys) values.push_back(effective_value(ablation, variant, key));
    for (std::size_t i = 0; i < results.runs().size(); ++i) {
      const reproduce::Run& run = results.runs()[i];
      if (run.group != group) continue;
      std::vector<std::string> row{ablation.name, variant.name, v == ablation.baseline ? "1" : "0",
                                   run.estimators.front()};
      row.insert(row.end(), values.begin(), values.end());
      row.insert(row.end(),
                 {run.world_name, run.sequence, run.scene, run.range_m ? fmt::format("{:g}", *run.range_m) : "",
                  fmt::format("{:g}", run.noise_ut ? *run.noise_ut : noise.of(run.world, settings)),
                  fmt::format("{}", run.seed), status[i]});
      const RunFigures* known = results.find(i, run.estimators.front());
      for (const std::string& name : figures) {
        const std::optional<double> value = reproduce::value_of(known, name);
        row.push_back(value ? fmt::format("{}", *value) : "");
      }
      row.push_back(run.folder);
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

}  // namespace lodestone::ablation
