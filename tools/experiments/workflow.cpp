#include "tools/experiments/workflow.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/error.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/text_file.h"
#include "tools/experiments/child_process.h"
#include "tools/experiments/experiment.h"
#include "tools/progress.h"
#include "tools/shipped_files.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

constexpr auto kPause = std::chrono::milliseconds(20);
constexpr const char* kStepsFile = "logs/steps.json";
constexpr const char* kSnakemakeLog = "logs/snakemake.log";

}  // namespace

Workflow::Workflow(const Plan& plan, const StepStore& store, WorkflowOptions options)
    : plan_(plan),
      store_(store),
      options_(std::move(options)),
      states_(plan.steps.size(), StepState::unneeded),
      dependents_(plan.steps.size()) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    for (const std::size_t need : plan.steps[i].needs) dependents_[need].push_back(i);
  }
  // Steps elapsed before their dependents. In reverse order, the state of all dependents of a step is known.
  for (std::size_t i = plan.steps.size(); i-- > 0;) {
    const Step& step = plan.steps[i];
    const bool asked = std::any_of(dependents_[i].begin(), dependents_[i].end(),
                                   [&](std::size_t dependent) { return states_[dependent] == StepState::waiting; });
    if (step.kept() || asked) states_[i] = store.is_done(step) ? StepState::done : StepState::waiting;
  }
}

bool Workflow::all_done() const {
  return std::all_of(states_.begin(), states_.end(),
                     [](StepState state) { return state == StepState::done || state == StepState::unneeded; });
}

/// The waiting steps. What is done is not named: Snakemake would compare its time with that of other files.
std::string Workflow::steps_file() const {
  nlohmann::ordered_json json;
  json["program"] = program();
  json["threads"] = options_.threads;
  json["steps"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i] != StepState::waiting) continue;
    const Step& step = plan_.steps[i];
    nlohmann::ordered_json one;
    one["name"] = step.name;
    one["kind"] = options_detail::write_value(step.kind);
    one["folder"] = step.folder;
    one["log"] = fs::relative(store_.log_of(step), store_.root()).string();
    one["kept"] = step.kept();
    one["commands"] = step.commands;
    one["intermediate"] = step.intermediate;
    one["stamp"] = StepStore::stamp_of(step);
    one["needs"] = nlohmann::ordered_json::array();
    for (const std::size_t need : step.needs) {
      if (states_[need] == StepState::waiting) one["needs"].push_back(plan_.steps[need].folder);
    }
    json["steps"].push_back(std::move(one));
  }
  return json.dump(1) + "\n";
}

/// The running program, even if its file is replaced meanwhile. Nodes of a cluster get a copy.
std::string Workflow::program() const {
  if (options_.profile.empty()) return fmt::format("/proc/{}/exe", getpid());
  const fs::path copy = store_.root() / "logs" / "program";
  std::error_code error;
  fs::copy_file("/proc/self/exe", copy.string() + ".new", fs::copy_options::overwrite_existing, error);
  if (!error) fs::rename(copy.string() + ".new", copy, error);
  if (error) throw InputError(fmt::format("{}: cannot be written: {}", copy.string(), error.message()));
  return copy.string();
}

std::vector<std::string> Workflow::command() const {
  std::vector<std::string> words{"--snakefile",          find_fleet_file("experiment.smk"),
                                 "--directory",          store_.root().string(),
                                 "--log-handler-script", find_fleet_file("experiment_progress.py"),
                                 "--keep-going",         "--nolock",
                                 "--rerun-incomplete",   "--forceall",
                                 "--scheduler",          "greedy"};
  if (options_.profile.empty()) {
    words.insert(words.end(), {"--cores", std::to_string(options_.jobs * options_.threads)});
  } else {
    words.insert(words.end(), {"--profile", fs::absolute(options_.profile).string()});
    if (options_.jobs > 0) words.insert(words.end(), {"--jobs", std::to_string(options_.jobs)});
  }
  return words;
}

std::size_t Workflow::count(StepState state) const {
  return static_cast<std::size_t>(std::count(states_.begin(), states_.end(), state));
}

void Workflow::conclude(const std::string& end) {
  const std::size_t waiting = count(StepState::waiting);
  for (std::size_t i = states_.size(); i-- > 0;) {
    if (states_[i] != StepState::waiting) continue;
    const Step& step = plan_.steps[i];
    const auto& dependents = dependents_[i];
    // Files that no step needs any more are gone.
    const bool over = !step.kept() && std::all_of(dependents.begin(), dependents.end(), [&](std::size_t dependent) {
      return states_[dependent] == StepState::done;
    });
    if (over || store_.is_done(step)) {
      states_[i] = StepState::done;
    } else {
      states_[i] = fs::exists(store_.log_of(step)) ? StepState::failed : StepState::blocked;
    }
  }
  store_.remove_elapsed(plan_);
  std::error_code ignored;
  fs::remove_all(store_.root() / ".snakemake", ignored);
  const std::size_t blocked = count(StepState::blocked);
  if (blocked == waiting) throw InputError(end);
  if (blocked > 0 && count(StepState::failed) == 0) spdlog::error("lodestone: {}", end);
}

void Workflow::run() {
  store_.remove_strangers(plan_);
  if (all_done()) {
    store_.remove_elapsed(plan_);
    return;
  }
  std::error_code ignored;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i] == StepState::waiting) fs::remove(store_.log_of(plan_.steps[i]), ignored);
  }
  write_text_file(store_.root() / kStepsFile, steps_file());
  const fs::path log = store_.root() / kSnakemakeLog;
  ChildProcess snakemake("snakemake", command(), store_.root().string(), log.string(),
                         spdlog::should_log(spdlog::level::info));
  while (!snakemake.poll()) {
    if (interrupt_requested()) {
      // Snakemake itself cancels jobs on a cluster; what submits them must not be interrupted.
      snakemake.interrupt(options_.profile.empty());
      while (!snakemake.poll()) std::this_thread::sleep_for(kPause);
      snakemake.end_group();
      throw Interrupted();
    }
    std::this_thread::sleep_for(kPause);
  }
  snakemake.end_group();
  throw_if_interrupted();
  conclude(fmt::format("snakemake ended with exit code {} before all steps were done; see {}", *snakemake.poll(),
                       log.string()));
}

}  // namespace lodestone::reproduce
