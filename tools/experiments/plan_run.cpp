#include "tools/experiments/plan_run.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "core/error.h"
#include "tools/commands.h"
#include "tools/run/fingerprint.h"
#include "tools/simulate/world_queries.h"

namespace lodestone::reproduce {

namespace {

constexpr const char* kProgram = "/proc/self/exe";
constexpr int kMostJobs = 4;  // a job may need 2 GB of memory and disk space for a log

WorkflowOptions workflow_options(const std::optional<int>& jobs, const std::string& profile) {
  if (jobs && *jobs < 1) throw InputError(fmt::format("--jobs: expected at least 1, found {}", *jobs));
  WorkflowOptions options;
  options.profile = profile;
  if (!profile.empty()) {
    if (!std::filesystem::exists(std::filesystem::path(profile) / "config.yaml")) {
      throw InputError(
          fmt::format("--profile: {}/config.yaml is missing: expected a folder with a profile of Snakemake, "
                      "such as tools/fleet/slurm",
                      profile));
    }
    if (profile.find(' ') != std::string::npos) {
      throw InputError(
          fmt::format("--profile: {}: Snakemake takes no path with a space; link or copy the folder", profile));
    }
    options.jobs = jobs.value_or(0);
    return options;
  }
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  options.jobs = jobs.value_or(std::min(cores, kMostJobs));
  options.threads = std::max(1, cores / options.jobs);
  return options;
}

std::string plural(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

void check_worlds(const Experiment& experiment, const std::vector<Run>& runs) {
  for (const Group& group : experiment.groups) {
    for (const Drive& drive : group.drives) {
      const bool meant = std::any_of(runs.begin(), runs.end(), [&](const Run& run) {
        return run.group == group.name && run.world_name == drive.world_name && run.sequence == drive.sequence;
      });
      if (!meant) continue;
      std::vector<std::string> scenes = drive.map_scenes;
      scenes.push_back(drive.scene);
      simulation::require_in_world(drive.world, group.world_settings, drive.sequence, scenes);
    }
  }
}

PlanRun::PlanRun(const Experiment& experiment, const WorkOptions& options)
    : file_(experiment.file),
      work_options_(workflow_options(options.jobs, options.profile)),
      plan_(make_plan(experiment, Fingerprint().add_file(kProgram).to_string())) {
  for (Step& step : plan_.steps) step.keep = step.keep || (options.keep_fields && step.kind == StepKind::field);
  check_worlds(experiment, plan_.runs);
  store_ = std::make_unique<StepStore>(options.out, options.any_build);
  workflow_ = std::make_unique<Workflow>(plan_, *store_, work_options_);
}

void PlanRun::run() {
  const std::string where =
      work_options_.profile.empty()
          ? fmt::format("{} with {} each", plural(static_cast<std::size_t>(work_options_.jobs), "job"),
                        plural(static_cast<std::size_t>(work_options_.threads), "thread"))
          : fmt::format("profile {}", work_options_.profile);
  spdlog::info("{}: {} in {}, {} steps to do, {}", file_, plural(plan_.runs.size(), "run"), root().string(),
               workflow_->count(StepState::waiting), where);
  workflow_->run();
}

std::vector<bool> PlanRun::done() const {
  std::vector<bool> done;
  for (const Run& run : plan_.runs) done.push_back(workflow_->states()[run.step] == StepState::done);
  return done;
}

std::vector<std::string> PlanRun::status() const {
  std::vector<std::string> status;
  for (const Run& run : plan_.runs) {
    const StepState state = workflow_->states()[run.step];
    const bool failed = state == StepState::failed || state == StepState::blocked;
    status.emplace_back(state == StepState::done ? "done" : failed ? "failed" : "missing");
  }
  return status;
}

int PlanRun::exit_code() const {
  if (workflow_->all_done()) return lodestone::exit_code::done;
  spdlog::error(
      "lodestone: {} of {} steps failed; {} steps that depend on them were not started; repeat the call to try again",
      workflow_->count(StepState::failed), plan_.steps.size(), workflow_->count(StepState::blocked));
  return lodestone::exit_code::input_error;
}

}  // namespace lodestone::reproduce
