#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/evaluation/statistics.h"
#include "frontends/configuration/options.h"
#include "tools/evaluate/comparison.h"
#include "tools/table.h"

namespace lodestone {

namespace {

std::vector<double> magnitudes(std::vector<double> errors) {
  for (double& error : errors) error = std::abs(error);
  return errors;
}

}  // namespace

std::string to_table(const Comparison& comparison) {
  std::string text =
      fmt::format("{} pairs of {} estimated and {} ground-truth poses, aligned: {}", comparison.pairs,
                  comparison.estimate_poses, comparison.truth_poses, options_detail::write_value(comparison.alignment));
  if (comparison.alignment == Alignment::sim3) text += fmt::format(" (scale {:.6f})", comparison.similarity.scale);
  text += "\n\n";
  Table table({"error", "unit", "count", "rmse", "mean", "median", "95 %", "max", "std"});
  for (const RelationErrors& relation : comparison.relations) {
    const ErrorStatistics statistics = summarize(magnitudes(relation.errors));
    const ErrorDistribution distribution(magnitudes(relation.errors));
    table.add({relation.name, relation.unit, std::to_string(statistics.count), fixed(statistics.rmse, 6),
               fixed(statistics.mean, 6), fixed(statistics.median, 6), fixed(distribution.quantile(0.95), 6),
               fixed(statistics.max, 6), fixed(statistics.standard_deviation, 6)});
  }
  text += table.to_string();
  if (comparison.consistency) {
    const Consistency& c = *comparison.consistency;
    text += fmt::format(
        "\nNEES per degree of freedom (1 is consistent, above 1 overconfident), {} poses{}:\n"
        "  pose {:.3f}   rotation {:.3f}   position {:.3f}   within the 95 % bound: {:.1f} %\n",
        c.count, c.singular > 0 ? fmt::format(", {} without a usable covariance", c.singular) : "", c.nees,
        c.nees_rotation, c.nees_position, 100.0 * c.share_within_95);
  }
  return text;
}

std::string to_json(const Comparison& comparison) {
  using Json = nlohmann::ordered_json;
  Json root;
  root["pairs"] = comparison.pairs;
  root["estimate_poses"] = comparison.estimate_poses;
  root["truth_poses"] = comparison.truth_poses;
  const Similarity& s = comparison.similarity;
  root["alignment"] = {{"kind", options_detail::write_value(comparison.alignment)},
                       {"translation_m", {s.translation.x(), s.translation.y(), s.translation.z()}},
                       {"rotation_xyzw", {s.rotation.x(), s.rotation.y(), s.rotation.z(), s.rotation.w()}},
                       {"scale", s.scale}};
  Json relations = Json::object();
  for (const RelationErrors& relation : comparison.relations) {
    const ErrorStatistics statistics = summarize(magnitudes(relation.errors));
    const ErrorDistribution distribution(magnitudes(relation.errors));
    Json quantiles;
    for (const int percent : {25, 50, 75, 90, 95, 99}) {
      quantiles[std::to_string(percent)] = distribution.quantile(0.01 * percent);
    }
    relations[relation.name.substr(0, relation.name.find(' '))] = {
        {"unit", relation.unit},   {"count", statistics.count},   {"rmse", statistics.rmse},
        {"mean", statistics.mean}, {"median", statistics.median}, {"std", statistics.standard_deviation},
        {"min", statistics.min},   {"max", statistics.max},       {"quantiles", quantiles}};
  }
  root["relations"] = relations;
  if (comparison.consistency) {
    const Consistency& c = *comparison.consistency;
    root["nees"] = {{"count", c.count},
                    {"singular", c.singular},
                    {"pose", c.nees},
                    {"rotation", c.nees_rotation},
                    {"position", c.nees_position},
                    {"share_within_95", c.share_within_95}};
  }
  return root.dump(2) + "\n";
}

}  // namespace lodestone
