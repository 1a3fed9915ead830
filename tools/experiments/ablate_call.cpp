#include "tools/experiments/ablate_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/experiments/ablation_tables.h"
#include "tools/experiments/plan_run.h"
#include "tools/experiments/table_files.h"
#include "tools/plotting/forest_plot.h"
#include "tools/table.h"
#include "tools/writers/output_folder.h"

namespace lodestone::ablation {

namespace fs = std::filesystem;

namespace {

/// All names that a pattern of --only may match for a run.
std::vector<std::string> names_of(const Variant& variant, const reproduce::Run& run) {
  const std::string drive = drive_name(run);
  return {variant.name,
          drive,
          run.world_name,
          run.sequence,
          variant.name + "/" + drive,
          fmt::format("{}/{}/seed{}", variant.name, drive, run.seed)};
}

/// Lists variants with their switches, and drives: the names that --only accepts.
void print_runs(const Ablation& ablation, const reproduce::Experiment& experiment) {
  const std::vector<reproduce::Run> runs = reproduce::list_runs(experiment);
  reproduce::check_worlds(experiment, runs);
  Table variants({"variant", "runs", "switches"});
  std::vector<std::string> drives;
  for (std::size_t i = 0; i < ablation.variants.size(); ++i) {
    const Variant& variant = ablation.variants[i];
    std::size_t count = 0;
    for (const reproduce::Run& run : runs) {
      if (run.group != recipe_name(ablation, variant)) continue;
      ++count;
      reproduce::place_of(drive_name(run), drives);
    }
    std::string switches;
    for (const Switch& one : variant.switches)
      switches += fmt::format("{}{}={}", switches.empty() ? "" : " ", one.key, one.value);
    variants.add({variant.name + (i == ablation.baseline ? " (baseline)" : ""), std::to_string(count), switches});
  }
  std::printf("%s\ndrives: %s\nseeds: %s\n%zu runs, called VARIANT/DRIVE/seedN\n", variants.to_string().c_str(),
              fmt::format("{}", fmt::join(drives, ", ")).c_str(),
              fmt::format("{}", fmt::join(experiment.seeds, ", ")).c_str(), runs.size());
}

figures::ForestPlot forest_of(const Ablation& ablation, const reproduce::Results& results) {
  figures::ForestPlot plot;
  plot.axis = fmt::format("ATE over that of “{}”: geometric mean and 95 % interval; points: pairs of runs",
                          ablation.variants[ablation.baseline].name);
  for (std::size_t i = 0; i < ablation.variants.size(); ++i) {
    const std::vector<Pair> pairs = pairs_of(ablation, ablation.variants[i], results);
    if (i == ablation.baseline || pairs.empty()) continue;
    const Comparison comparison = compare_pairs(pairs, "ate_m");
    figures::ForestRow row{ablation.variants[i].name, comparison.ratios, comparison.over_pairs, ""};
    if (comparison.done == 0) row.note = "not run";
    if (comparison.lost > 0) row.note = fmt::format("{} lost", comparison.lost);
    if (comparison.baseline_lost > 0) {
      row.note += fmt::format("{}baseline {} lost", row.note.empty() ? "" : ", ", comparison.baseline_lost);
    }
    plot.rows.push_back(std::move(row));
  }
  return plot;
}

void write_results(const Ablation& ablation, const reproduce::PlanRun& work) {
  const fs::path& root = work.root();
  const reproduce::Results results(work.plan(), root, work.done());
  made_folder(root / "tables");
  made_folder(root / "figures");
  for (const reproduce::ResultTable& table : {summary_table(ablation, results), drives_table(ablation, results)}) {
    reproduce::write_table(root / "tables", table);
    std::printf("\n%s", to_markdown(table).c_str());
  }
  const reproduce::ResultTable runs = tidy_table(ablation, results, work.status());
  const fs::path runs_file = root / "tables" / (runs.name + ".csv");
  write_text_file(runs_file, to_csv(runs));
  const fs::path picture = root / "figures" / ablation.name;
  figures::draw_forest_plot(picture, forest_of(ablation, results));
  std::printf("\nevery run: %s\npicture: %s.png, .pdf, .svg\n", runs_file.c_str(), picture.c_str());
}

}  // namespace

reproduce::Experiment meant_runs(const Ablation& ablation) {
  reproduce::Experiment experiment = to_experiment(ablation);
  if (ablation.only.empty()) return experiment;
  const std::vector<reproduce::Run> runs = reproduce::list_runs(experiment);
  const auto variant_of = [&](const reproduce::Run& run) -> const Variant& {
    return *std::find_if(ablation.variants.begin(), ablation.variants.end(),
                         [&](const Variant& variant) { return recipe_name(ablation, variant) == run.group; });
  };
  std::vector<std::string> known;
  std::set<std::string> unused(ablation.only.begin(), ablation.only.end());
  std::set<std::string> conditions;  // of the selected runs: the baseline runs under the same conditions
  for (const reproduce::Run& run : runs) {
    const std::vector<std::string> names = names_of(variant_of(run), run);
    for (const std::string& name : names) {
      reproduce::place_of(name, known);
    }
    for (const std::string& pattern : ablation.only) {
      if (!reproduce::fits(pattern, names)) continue;
      unused.erase(pattern);
      conditions.insert(fmt::format("{}/{}", drive_name(run), run.seed));
      experiment.only.push_back(run.name);
      break;
    }
  }
  if (!unused.empty()) {
    throw InputError(fmt::format("no run matches '{}'{} (lodestone ablate --list names them)", *unused.begin(),
                                 suggestion(*unused.begin(), known)));
  }
  const std::string baseline = recipe_name(ablation, ablation.variants[ablation.baseline]);
  for (const reproduce::Run& run : runs) {
    const bool asked = run.group == baseline && conditions.count(fmt::format("{}/{}", drive_name(run), run.seed)) > 0;
    if (asked) experiment.only.push_back(run.name);
  }
  return experiment;
}

int execute(const reproduce::ExperimentCall& call) {
  Ablation ablation = load_ablation(find_ablation(call.experiment), call.quick);
  reproduce::override_scope(ablation, call.only, call.seeds);
  const reproduce::Experiment experiment = meant_runs(ablation);
  if (call.list) {
    print_runs(ablation, experiment);
    return exit_code::done;
  }
  if (call.out.empty()) throw InputError("--out: expected a folder for the results (or --list)");
  reproduce::PlanRun work(experiment, {call.out, call.any_build, call.jobs, call.profile, true});
  work.run();
  write_results(ablation, work);
  return work.exit_code();
}

}  // namespace lodestone::ablation
