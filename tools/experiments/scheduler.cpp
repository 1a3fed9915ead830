#include "tools/experiments/scheduler.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <sstream>
#include <thread>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/experiments/child_process.h"
#include "tools/progress.h"

namespace lodestone::reproduce {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPause = std::chrono::milliseconds(20);
constexpr auto kGrace = std::chrono::seconds(10);  // for children to exit after a signal

bool is_over(StepState state) {
  return state == StepState::done || state == StepState::unneeded || state == StepState::failed ||
         state == StepState::blocked;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

struct Scheduler::Active {
  std::size_t index = 0;
  std::size_t command = 0;  ///< index of the step's running command
  Clock::time_point start = Clock::now();
  std::unique_ptr<ChildProcess> child;
};

Scheduler::Scheduler(const Plan& plan, const StepStore& store, ScheduleOptions options)
    : plan_(plan),
      store_(store),
      options_(std::move(options)),
      states_(plan.steps.size(), StepState::unneeded),
      dependents_(plan.steps.size()),
      progress_(options_.progress) {
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

bool Scheduler::all_done() const {
  return std::all_of(states_.begin(), states_.end(),
                     [](StepState state) { return state == StepState::done || state == StepState::unneeded; });
}

bool Scheduler::is_ready(std::size_t index) const {
  if (states_[index] != StepState::waiting) return false;
  const auto& needs = plan_.steps[index].needs;
  return std::all_of(needs.begin(), needs.end(), [&](std::size_t need) { return states_[need] == StepState::done; });
}

/// Logs fill the disk. One log per job, and one that is being simulated, keep all jobs busy.
bool Scheduler::may_open_another_log() const {
  int logs = 0;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (plan_.steps[i].kind != StepKind::log) continue;
    if (states_[i] == StepState::active ||
        (states_[i] == StepState::done && !dependents_[i].empty() &&
         !std::all_of(dependents_[i].begin(), dependents_[i].end(),
                      [&](std::size_t dependent) { return is_over(states_[dependent]); }))) {
      ++logs;
    }
  }
  return logs <= options_.jobs;
}

void Scheduler::advance(Active& active) {
  const Step& step = plan_.steps[active.index];
  std::vector<std::string> command = step.commands[active.command];
  if (step.kind != StepKind::difference) command.insert(command.end(), {"--threads", std::to_string(options_.threads)});
  std::string line = "$ lodestone";
  for (const std::string& word : command) line += " " + word;
  const std::string log = store_.log_of(step).string();
  write_text_file(log, read_text_file(log) + line + "\n");
  active.child = std::make_unique<ChildProcess>(options_.program, command, store_.root().string(), log);
}

void Scheduler::start_ready(std::vector<Active>& active) {
  for (std::size_t i = 0; i < states_.size() && static_cast<int>(active.size()) < options_.jobs; ++i) {
    if (!is_ready(i)) continue;
    if (plan_.steps[i].kind == StepKind::log && !may_open_another_log()) continue;
    store_.begin(plan_.steps[i]);
    active.push_back({i, 0, Clock::now(), nullptr});
    states_[i] = StepState::active;
    advance(active.back());
  }
}

std::string Scheduler::last_line(const Step& step) const {
  std::istringstream text(read_text_file(store_.log_of(step).string()));
  std::string last;
  for (std::string line; std::getline(text, line);) {
    if (!line.empty()) last = line;
  }
  constexpr std::string_view prefix = "lodestone: ";
  return last.starts_with(prefix) ? last.substr(prefix.size()) : last;
}

void Scheduler::block_dependents(std::size_t index) {
  for (const std::size_t dependent : dependents_[index]) {
    if (states_[dependent] != StepState::waiting) continue;
    states_[dependent] = StepState::blocked;
    block_dependents(dependent);
  }
}

void Scheduler::remove_unneeded() {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (plan_.steps[i].kept() || states_[i] == StepState::waiting || states_[i] == StepState::active) continue;
    const bool over = std::all_of(dependents_[i].begin(), dependents_[i].end(),
                                  [&](std::size_t dependent) { return is_over(states_[dependent]); });
    if (over) store_.remove(plan_.steps[i]);
  }
}

void Scheduler::conclude(const Active& active, int code) {
  const Step& step = plan_.steps[active.index];
  // Lost track is a valid result of a run, not a failure.
  const bool good = code == exit_code::done || (step.kind == StepKind::run && code == exit_code::track_lost);
  std::string text;
  if (good) {
    store_.finish(step);
    states_[active.index] = StepState::done;
    times_.learn(step, seconds_since(active.start));
    text = fmt::format("{}: done in {:.0f} s", step.name, seconds_since(active.start));
  } else {
    states_[active.index] = StepState::failed;
    block_dependents(active.index);
    const std::string what =
        code > 128 ? fmt::format("ended by signal {}", code - 128) : fmt::format("exit code {}", code);
    text = fmt::format("{}: {}: {} (see {})", step.name, what, last_line(step), store_.log_of(step).string());
  }
  remove_unneeded();
  progress_.tell(share({}), text);
}

WorkShare Scheduler::share(const std::vector<Active>& active) const {
  WorkShare work;
  double done = 0.0;
  double left = 0.0;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i] == StepState::unneeded || was_done_[i]) continue;
    const double seconds = times_.expected(plan_.steps[i]);
    ++work.total;
    if (is_over(states_[i])) ++work.done;
    (is_over(states_[i]) ? done : left) += seconds;
  }
  for (const Active& one : active) {
    const double elapsed = std::min(seconds_since(one.start), 0.95 * times_.expected(plan_.steps[one.index]));
    done += elapsed;
    left -= elapsed;
    work.active += (work.active.empty() ? "" : ", ") + plan_.steps[one.index].name;
  }
  work.share = done + left > 0.0 ? done / (done + left) : 1.0;
  work.seconds_left = left / options_.jobs;
  return work;
}

void Scheduler::run() {
  for (const StepState state : states_) was_done_.push_back(state == StepState::done);
  store_.remove_strangers(plan_);
  remove_unneeded();
  std::vector<Active> active;
  for (start_ready(active); !active.empty() && !interrupt_requested(); start_ready(active)) {
    for (std::size_t i = 0; i < active.size();) {
      const std::optional<int> code = active[i].child->poll();
      if (code == exit_code::done && ++active[i].command < plan_.steps[active[i].index].commands.size()) {
        advance(active[i]);
      } else if (code && !interrupt_requested()) {
        const Active ended = std::move(active[i]);
        active.erase(active.begin() + static_cast<std::ptrdiff_t>(i));
        conclude(ended, *code);
        continue;
      }
      ++i;
    }
    progress_.update(share(active));
    std::this_thread::sleep_for(kPause);
  }
  progress_.finish();
  if (!interrupt_requested()) return;
  for (Active& one : active) one.child->interrupt();
  const Clock::time_point begin = Clock::now();
  while (Clock::now() - begin < kGrace &&
         !std::all_of(active.begin(), active.end(), [](Active& one) { return one.child->poll().has_value(); })) {
    std::this_thread::sleep_for(kPause);
  }
  throw Interrupted();
}

}  // namespace lodestone::reproduce
