#include "tools/experiments/pairs.h"

#include <cmath>
#include <tuple>

namespace lodestone::ablation {

namespace {

auto conditions(const reproduce::Run& run) {
  return std::tuple(run.world, run.sequence, run.log_scene, run.scene, run.range_m.value_or(0.0), run.seed);
}

}  // namespace

std::string drive_name(const reproduce::Run& run) {
  return reproduce::row_name(run.world_name, run.sequence, run.range_m, std::nullopt, run.scene);
}

std::optional<double> figure_of(const reproduce::RunFigures& figures, const std::string& name) {
  const std::optional<double> value = reproduce::value_of(&figures, name);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

bool is_lost(const reproduce::RunFigures& figures) {
  return figure_of(figures, "success") == 0.0;
}

std::vector<Pair> pairs_of(const Ablation& ablation, const Variant& variant, const reproduce::Results& results) {
  const auto& runs = results.runs();
  const std::string group = recipe_name(ablation, variant);
  const std::string baseline = recipe_name(ablation, ablation.variants[ablation.baseline]);
  std::map<decltype(conditions(runs.front())), std::size_t> counterparts;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].group == baseline) counterparts.emplace(conditions(runs[i]), i);
  }
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].group != group) continue;
    Pair pair{drive_name(runs[i]), runs[i].seed, results.find(i, runs[i].estimators.front()), nullptr};
    const auto found = counterparts.find(conditions(runs[i]));
    if (found != counterparts.end())
      pair.baseline = results.find(found->second, runs[found->second].estimators.front());
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

Comparison compare_pairs(const std::vector<Pair>& pairs, const std::string& figure) {
  Comparison comparison;
  comparison.pairs = pairs.size();
  for (const Pair& pair : pairs) {
    if (!pair.both_done()) continue;
    ++comparison.done;
    const bool lost = is_lost(*pair.variant);
    const bool baseline_lost = is_lost(*pair.baseline);
    comparison.lost += lost ? 1 : 0;
    comparison.baseline_lost += baseline_lost ? 1 : 0;
    if (lost || baseline_lost) {
      if (!lost) ++comparison.better;
      if (!baseline_lost) ++comparison.worse;
      continue;
    }
    const std::optional<double> own = figure_of(*pair.variant, figure);
    const std::optional<double> other = figure_of(*pair.baseline, figure);
    if (!own || !other) continue;
    ++(*own < *other ? comparison.better : *own > *other ? comparison.worse : comparison.equal);
    if (!(*own > 0.0 && *other > 0.0)) continue;
    comparison.ratios.push_back(*own / *other);
    comparison.by_drive[pair.drive].push_back(*own / *other);
  }
  if (comparison.ratios.empty()) return comparison;
  comparison.over_pairs = estimate_ratio(comparison.ratios);
  std::vector<double> means;
  for (const auto& [drive, ratios] : comparison.by_drive) means.push_back(estimate_ratio(ratios).ratio);
  comparison.over_drives = estimate_ratio(means);
  return comparison;
}

std::optional<double> geometric_mean(const std::vector<Pair>& pairs, const std::string& figure) {
  std::vector<double> values;
  for (const Pair& pair : pairs) {
    if (pair.variant == nullptr || is_lost(*pair.variant)) continue;
    const std::optional<double> value = figure_of(*pair.variant, figure);
    if (value && *value > 0.0) values.push_back(*value);
  }
  if (values.empty()) return std::nullopt;
  return estimate_ratio(values).ratio;  // RatioEstimate::ratio is the geometric mean
}

}  // namespace lodestone::ablation
