#include "tools/reproduce/reproduce_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "core/error.h"
#include "frontends/readers/text_file.h"
#include "frontends/simulation/world.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/report/report.h"
#include "tools/reproduce/figures.h"
#include "tools/reproduce/fingerprint.h"
#include "tools/reproduce/reproduce_file.h"
#include "tools/reproduce/scheduler.h"
#include "tools/reproduce/table_files.h"
#include "tools/table.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

constexpr const char* kProgram = "/proc/self/exe";
constexpr int kMostJobs = 4;  // a job may hold 2 GB of memory and a log on the disk

Experiment read_experiment(const ReproduceCall& call) {
  Experiment experiment = load_experiment(find_experiment(call.experiment), call.quick);
  if (!call.only.empty()) experiment.only = call.only;
  if (!call.seeds.empty()) experiment.seeds = call.seeds;
  for (const int seed : experiment.seeds) {
    if (seed < 0 || std::count(experiment.seeds.begin(), experiment.seeds.end(), seed) > 1) {
      throw InputError(fmt::format("--seeds: expected different whole numbers from 0, found {}", fmt::join(experiment.seeds, ",")));
    }
  }
  return experiment;
}

/// What a world lacks is better said before the first hour than after it.
void check_worlds(const Experiment& experiment, const Plan& plan) {
  for (const Group& group : experiment.groups) {
    for (const Drive& drive : group.drives) {
      const bool meant = std::any_of(plan.runs.begin(), plan.runs.end(), [&](const Run& run) {
        return run.group == group.name && run.world_name == drive.world_name && run.sequence == drive.sequence;
      });
      if (!meant) continue;
      const simulation::World world = simulation::load_world(drive.world, group.world_settings);
      simulation::find_sequence(world, drive.sequence);
      std::vector<std::string> scenes = drive.map_scenes;
      scenes.push_back(drive.scene);
      for (const std::string& scene : scenes) {
        if (scene != simulation::no_scene) simulation::find_scene(world, scene);
      }
    }
  }
}

void print_runs(const std::vector<Run>& runs) {
  Table table({"run", "estimators"});
  for (const Run& run : runs) table.add({run.name, fmt::format("{}", fmt::join(run.estimators, ","))});
  std::printf("%s%zu runs\n", table.to_string().c_str(), runs.size());
}

ScheduleOptions schedule_options(const ReproduceCall& call) {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (call.jobs && *call.jobs < 1) throw InputError(fmt::format("--jobs: expected at least 1, found {}", *call.jobs));
  ScheduleOptions options;
  options.program = kProgram;
  options.jobs = call.jobs.value_or(std::min(cores, kMostJobs));
  options.threads = std::max(1, cores / options.jobs);
  return options;
}

std::string plural(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// Tables, figures, reproduce.json and report of what is there.
void write_results(const Experiment& experiment, const Plan& plan, const std::vector<StepState>& states, const fs::path& root) {
  std::vector<bool> done;
  std::vector<std::string> status;
  for (const Run& run : plan.runs) {
    done.push_back(states[run.step] == StepState::done);
    const bool failed = states[run.step] == StepState::failed || states[run.step] == StepState::blocked;
    status.emplace_back(done.back() ? "done" : failed ? "failed" : "missing");
  }
  const Results results(plan, root, done);
  std::vector<ResultTable> tables;
  for (const TableChoice& table : experiment.tables) {
    if (!results.rows_of(table.group).empty()) tables.push_back(make_table(table, experiment, results));
  }
  if (!experiment.criteria.empty()) tables.push_back(criteria_table(experiment, results));
  // Tables of another call with other runs must not stand beside these.
  std::error_code error;
  fs::remove_all(root / "tables", error);
  fs::create_directories(root / "tables", error);
  if (error) throw InputError(fmt::format("{}: cannot make this folder: {}", (root / "tables").string(), error.message()));
  for (const ResultTable& table : tables) {
    write_table(root / "tables", table);
    std::printf("\n%s", to_markdown(table).c_str());
  }
  write_text_file((root / "tables" / "runs.csv").string(), to_csv(runs_table(results)));
  const std::vector<DrawnFigure> figures = draw_figures(experiment, results, root);
  write_text_file((root / "reproduce.json").string(), to_json(experiment, results, status, tables, figures));
  const fs::path report = root / "report.html";
  const std::size_t size = write_report(root, report);
  std::printf("\n%s: %.1f MB, opens from disk\n", report.c_str(), static_cast<double>(size) * 1e-6);
}

}  // namespace

int execute(const ReproduceCall& call) {
  const Experiment experiment = read_experiment(call);
  if (call.list) {
    print_runs(list_runs(experiment));
    return exit_code::done;
  }
  if (call.out.empty()) throw InputError("--out: expected a folder for the results (or --list)");
  const ScheduleOptions options = schedule_options(call);
  const Plan plan = make_plan(experiment, Fingerprint().add_file(kProgram).to_string());
  check_worlds(experiment, plan);
  catch_interrupts();
  const StepStore store(call.out, call.any_build);
  Scheduler scheduler(plan, store, options);
  const auto count = [&](StepState state) {
    return static_cast<std::size_t>(std::count(scheduler.states().begin(), scheduler.states().end(), state));
  };
  std::fprintf(stderr, "%s: %s in %s, %zu steps to do, %s with %s each\n", experiment.file.c_str(),
               plural(plan.runs.size(), "run").c_str(), store.root().c_str(), count(StepState::waiting),
               plural(static_cast<std::size_t>(options.jobs), "job").c_str(),
               plural(static_cast<std::size_t>(options.threads), "thread").c_str());
  scheduler.run();
  write_results(experiment, plan, scheduler.states(), store.root());
  if (scheduler.all_done()) return exit_code::done;
  std::fprintf(stderr, "lodestone: %zu of %zu steps failed, %zu not begun for it; a further call tries them again\n",
               count(StepState::failed), plan.steps.size(), count(StepState::blocked));
  return exit_code::input_error;
}

}  // namespace lodestone::reproduce
