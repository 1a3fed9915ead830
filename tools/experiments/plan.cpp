#include "tools/experiments/plan.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <tuple>

#include "core/error.h"
#include "core/nearest_name.h"
#include "tools/run/fingerprint.h"

namespace lodestone::reproduce {

namespace {

/// Common inputs of all runs of one drive with one seed.
struct DriveKey {
  const Group* group = nullptr;
  const Drive* drive = nullptr;
  int seed = 0;
};

std::string joined(const std::vector<std::string>& parts, const char* separator) {
  return fmt::format("{}", fmt::join(parts, separator));
}

/// Makes each step once: steps are identified by their folder.
class StepBook {
 public:
  StepBook(const Experiment& experiment, std::string program) : experiment_(experiment), program_(std::move(program)) {}

  std::vector<Step> steps;

  std::size_t cloud(const DriveKey& key) {
    Step step =
        simulating(StepKind::cloud, key, "cloud", joined({key.drive->world_name, seed_text(key), "cloud"}, "-"));
    return add(std::move(step));
  }

  std::size_t log(const DriveKey& key) {
    std::vector<std::string> parts{key.drive->world_name, key.drive->sequence, seed_text(key)};
    if (key.group->noise_ut) parts.push_back(fmt::format("{:g}ut", *key.group->noise_ut));
    parts.emplace_back("log");
    Step step = simulating(StepKind::log, key, "log", joined(parts, "-"));
    std::vector<std::string>& command = step.commands.front();
    add_sequence(command, key, key.drive->scene);
    if (key.group->noise_ut) {
      append(command, {"--set", fmt::format("sensors.magnetometers.noise_ut={:g}", *key.group->noise_ut)});
    }
    if (experiment_.duration_s) append(command, {"--duration", fmt::format("{:g}", *experiment_.duration_s)});
    return add(std::move(step));
  }

  /// The survey always has the world's own noise: each map is made once and used in all conditions.
  std::size_t field(const DriveKey& key, const std::string& scene) {
    std::vector<std::string> parts{key.drive->world_name, key.drive->sequence, seed_text(key)};
    if (!scene.empty()) parts.push_back(scene);
    parts.emplace_back("field");
    std::vector<std::string> settings;
    for (const std::string& setting : key.group->map_settings) append(settings, {"--set", setting});
    Step step = simulating(StepKind::field, key, "survey", joined(parts, "-"), settings);
    add_sequence(step.commands.front(), key, scene);
    const std::string& folder = step.folder;
    step.commands.push_back({"map", "magnetic", folder + "/survey.bag", "--trajectory", folder + "/survey.tum",
                             "--platform", folder + "/platform.yaml", "--out", folder + "/field.yaml"});
    append(step.commands.back(), settings);
    step.intermediate = {folder + "/survey.bag"};
    return add(std::move(step));
  }

  std::size_t run(const DriveKey& key, const Run& run) {
    const std::size_t cloud_step = cloud(key);
    const std::size_t log_step = log(key);
    const std::size_t field_step = field(key, run.scene.empty() ? key.drive->scene : run.scene);
    const std::string data = steps[log_step].folder;
    Step step;
    step.kind = StepKind::run;
    step.name = run.name;
    step.world_name = run.world_name;
    step.folder = run.folder;
    step.needs = {cloud_step, log_step, field_step};
    step.parts = run.estimators.size();
    std::vector<std::string> command{"run",
                                     data + "/log.bag",
                                     "--platform",
                                     data + "/platform.yaml",
                                     "--cloud",
                                     steps[cloud_step].folder + "/cloud.pcd",
                                     "--magnetic",
                                     steps[field_step].folder + "/field.yaml",
                                     "--initial-pose-from",
                                     data + "/truth.tum",
                                     "--truth",
                                     data + "/truth.tum",
                                     "--estimator",
                                     joined(run.estimators, ","),
                                     "--out",
                                     run.folder};
    if (run.range_m) append(command, {"--max-range", fmt::format("{:g}", *run.range_m)});
    if (!key.group->run_config.empty()) {
      append(command, {"--config", key.group->run_config});
      step.inputs = {key.group->run_config};
    }
    for (const std::string& setting : key.group->run_settings) append(command, {"--set", setting});
    if (key.group->bound) command.emplace_back("--bound");
    if (!key.drive->grade.empty()) append(command, {"--calibration-truth", data + "/reality.yaml"});
    step.commands.push_back(command);
    return add(std::move(step));
  }

  std::size_t difference(const DriveKey& key, const std::string& scene, const std::string& folder) {
    Step step;
    step.kind = StepKind::difference;
    step.name = folder;
    step.world_name = key.drive->world_name;
    step.folder = folder;
    step.needs = {field(key, scene), field(key, key.drive->scene)};
    step.commands.push_back({"map", "diff", steps[step.needs[0]].folder + "/field.yaml",
                             steps[step.needs[1]].folder + "/field.yaml", "--out", folder});
    return add(std::move(step));
  }

 private:
  static std::string seed_text(const DriveKey& key) { return fmt::format("seed{}", key.seed); }

  static void append(std::vector<std::string>& command, const std::vector<std::string>& more) {
    command.insert(command.end(), more.begin(), more.end());
  }

  static void add_sequence(std::vector<std::string>& command, const DriveKey& key, const std::string& scene) {
    append(command, {"--sequence", key.drive->sequence});
    if (!scene.empty()) append(command, {"--scene", scene});
  }

  /// A step whose first command simulates `part` into the step's folder. `more`: further text that distinguishes the
  /// folder.
  Step simulating(StepKind kind, const DriveKey& key, const std::string& part, const std::string& name,
                  const std::vector<std::string>& more = {}) {
    Step step;
    step.kind = kind;
    step.name = name;
    step.world_name = key.drive->world_name;
    step.inputs = {key.drive->world};
    // Worlds with the same name, and groups with different settings, must not share a folder.
    Fingerprint origin;
    origin.add(std::to_string(namesake(*key.drive)));
    for (const std::string& setting : key.group->world_settings) origin.add(setting);
    for (const std::string& word : more) origin.add(word);
    if (!key.drive->grade.empty()) origin.add("--reality").add(key.drive->grade);
    const std::string ending = origin.to_string().substr(0, 6);
    if (!key.drive->grade.empty()) step.name += "-" + key.drive->grade;
    step.folder = fmt::format("work/{}-{}", step.name, ending);
    if (!key.group->world_settings.empty() || !more.empty())
      step.name += "-" + ending;  // the names of log files must differ too
    step.commands.push_back(
        {"simulate", key.drive->world, "--seed", std::to_string(key.seed), "--only", part, "--out", step.folder});
    if (!key.drive->grade.empty()) append(step.commands.front(), {"--reality", key.drive->grade});
    for (const std::string& setting : key.group->world_settings) append(step.commands.front(), {"--set", setting});
    return step;
  }

  std::size_t add(Step step) {
    const auto [known, is_new] = by_folder_.try_emplace(step.folder, steps.size());
    if (!is_new) return known->second;
    Fingerprint recipe;
    for (const auto& command : step.commands) {
      for (const std::string& word : command) {
        // Worlds and files of options are identified by their content, not by their path.
        const bool input = std::find(step.inputs.begin(), step.inputs.end(), word) != step.inputs.end();
        recipe.add(input ? "(input)" : word);
      }
      recipe.add("\n");
    }
    for (const std::string& input : step.inputs) recipe.add(content_of(input));
    for (const std::size_t need : step.needs) recipe.add(steps[need].recipe);
    step.recipe = recipe.to_string();
    step.fingerprint = recipe.add(program_).to_string();
    steps.push_back(std::move(step));
    return steps.size() - 1;
  }

  /// Number of a world among worlds with the same name. Folder names contain no paths: results can be moved together
  /// with their worlds.
  std::size_t namesake(const Drive& drive) { return place_of(drive.world, namesakes_[drive.world_name]); }

  const std::string& content_of(const std::string& path) {
    const auto [entry, is_new] = contents_.try_emplace(path);
    if (is_new) entry->second = Fingerprint().add_file(path).to_string();
    return entry->second;
  }

  const Experiment& experiment_;
  std::string program_;
  std::map<std::string, std::size_t> by_folder_;
  std::map<std::string, std::string> contents_;
  std::map<std::string, std::vector<std::string>> namesakes_;
};

struct PlannedRun {
  Run run;
  DriveKey key;
};

void list_rows(const Group& group, const Drive& drive, int seed, bool first_seed, std::vector<PlannedRun>& planned) {
  for (const Row& row : rows_of(group, drive)) {
    Run run;
    run.group = group.name;
    run.row = row.name;
    run.name = fmt::format("{}/{}/seed{}", group.name, run.row, seed);
    run.world = drive.world;
    run.world_name = drive.world_name;
    run.sequence = drive.sequence;
    run.scene = row.scene;
    run.log_scene = drive.scene;
    run.range_m = row.range_m;
    run.grade = drive.grade;
    run.noise_ut = group.noise_ut;
    run.seed = seed;
    run.first_seed = first_seed;
    for (const EstimatorChoice& estimator : group.estimators) {
      if (first_seed || estimator.seeds == SeedChoice::all) run.estimators.push_back(estimator.name);
    }
    run.folder = "runs/" + run.name;
    if (!run.estimators.empty()) planned.push_back({run, {&group, &drive, seed}});
  }
}

std::vector<PlannedRun> every_run(const Experiment& experiment) {
  std::vector<PlannedRun> planned;
  for (const Group& group : experiment.groups) {
    for (const Drive& drive : group.drives) {
      for (std::size_t i = 0; i < experiment.seeds.size(); ++i) {
        if (i > 0 && group.seeds == SeedChoice::first) break;
        list_rows(group, drive, experiment.seeds[i], i == 0, planned);
      }
    }
  }
  return planned;
}

void keep_only(const std::vector<std::string>& patterns, std::vector<PlannedRun>& planned) {
  if (patterns.empty()) return;
  std::vector<std::string> names;
  for (const PlannedRun& one : planned) {
    for (const std::string& name : {one.run.group, one.run.row, one.run.world_name, one.run.sequence}) {
      place_of(name, names);
    }
  }
  for (const std::string& pattern : patterns) {
    if (std::none_of(planned.begin(), planned.end(),
                     [&](const PlannedRun& one) { return matches(one.run, pattern); })) {
      throw InputError(fmt::format("no run matches '{}'{} (lodestone reproduce --list names them)", pattern,
                                   suggestion(pattern, names)));
    }
  }
  std::erase_if(planned, [&](const PlannedRun& one) {
    return std::none_of(patterns.begin(), patterns.end(),
                        [&](const std::string& pattern) { return matches(one.run, pattern); });
  });
}

std::vector<PlannedRun> meant_runs(const Experiment& experiment) {
  std::vector<PlannedRun> planned = every_run(experiment);
  keep_only(experiment.only, planned);
  return planned;
}

/// Keeps the maps that a figure shows, and adds the comparisons that it requires.
void add_figure(const FigureChoice& figure, std::vector<PlannedRun>& planned, StepBook& book, Plan& plan) {
  const bool compares = figure.kind == FigureKind::map_difference || figure.kind == FigureKind::field_residual;
  if (!compares && figure.kind != FigureKind::world_overview) return;
  for (const std::size_t i : shown_runs(figure, plan.runs)) {
    const DriveKey& key = planned[i].key;
    Run& run = plan.runs[i];
    const std::size_t field = book.field(key, run.scene.empty() ? key.drive->scene : run.scene);
    const std::size_t own = compares ? book.field(key, key.drive->scene) : field;
    for (const std::size_t step : {field, own}) book.steps[step].keep = true;
    run.field = book.steps[field].folder + "/field.yaml";
    run.own_field = book.steps[own].folder + "/field.yaml";
    if (figure.kind != FigureKind::map_difference || run.scene.empty()) continue;
    const std::string folder = fmt::format("differences/{}", run.name);
    plan.differences.push_back({run.name, book.difference(key, run.scene, folder), folder});
  }
}

}  // namespace

bool fits(const std::string& pattern, const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return fnmatch(pattern.c_str(), name.c_str(), 0) == 0; });
}

bool matches(const Run& run, const std::string& pattern) {
  return fits(pattern, {run.name, run.group, run.row, run.world_name, run.sequence, run.group + "/" + run.row});
}

std::vector<std::size_t> shown_runs(const FigureChoice& figure, const std::vector<Run>& runs) {
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const bool meant = std::any_of(figure.runs.begin(), figure.runs.end(),
                                   [&](const std::string& pattern) { return matches(runs[i], pattern); });
    if (meant && runs[i].first_seed) shown.push_back(i);
  }
  return shown;
}

std::vector<Run> list_runs(const Experiment& experiment) {
  std::vector<Run> runs;
  for (const PlannedRun& one : meant_runs(experiment)) runs.push_back(one.run);
  return runs;
}

Plan make_plan(const Experiment& experiment, const std::string& program) {
  std::vector<PlannedRun> planned = meant_runs(experiment);
  // Order: seed by seed and, within a seed, drive by drive across groups. Then few logs and clouds exist at a time, and
  // an interrupted call has all rows with the first seed.
  std::map<std::string, std::size_t> order;
  for (const PlannedRun& one : planned) {
    order.try_emplace(one.key.drive->world, order.size());
    order.try_emplace(one.key.drive->world + "\n" + one.run.sequence, order.size());
  }
  std::vector<std::size_t> execution(planned.size());
  for (std::size_t i = 0; i < execution.size(); ++i) execution[i] = i;
  const auto rank = [&](std::size_t i) {
    const PlannedRun& one = planned[i];
    const auto seed =
        std::find(experiment.seeds.begin(), experiment.seeds.end(), one.run.seed) - experiment.seeds.begin();
    return std::tuple(seed, order.at(one.key.drive->world), order.at(one.key.drive->world + "\n" + one.run.sequence));
  };
  std::stable_sort(execution.begin(), execution.end(), [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });

  Plan plan;
  StepBook book(experiment, program);
  for (const std::size_t i : execution) planned[i].run.step = book.run(planned[i].key, planned[i].run);
  for (const PlannedRun& one : planned) plan.runs.push_back(one.run);
  for (const FigureChoice& figure : experiment.figures) add_figure(figure, planned, book, plan);
  plan.steps = std::move(book.steps);
  return plan;
}

}  // namespace lodestone::reproduce
