#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

namespace lodestone::reproduce {

/// What a step makes.
enum class StepKind {
  cloud,       ///< simulate the cloud survey of a world
  log,         ///< simulate a drive
  field,       ///< simulate a survey drive and build the magnetic map from it
  run,         ///< localize a log
  difference,  ///< compare two magnetic maps
};

const char* step_kind_name(StepKind kind);

/// One link of the chain from worlds to results: commands of the program, run one after the other.
struct Step {
  std::string name;  ///< tells it to people; also its log's name
  StepKind kind = StepKind::run;
  std::string world_name;
  std::string folder;                              ///< below the output folder; the step owns all of it
  std::vector<std::vector<std::string>> commands;  ///< the program's arguments, paths relative to the output folder
  std::vector<std::string> inputs;                 ///< files from outside whose content counts (absolute)
  std::vector<std::size_t> needs;                  ///< steps that must be done before; all have smaller indices
  std::vector<std::string> intermediate;           ///< files that are removed as soon as the step is done
  std::size_t parts = 1;                           ///< estimators of a run: what its time grows with
  std::string recipe;                              ///< hash of commands, inputs and the recipes of `needs`
  std::string fingerprint;                         ///< the same, and of the program

  bool keep = false;  ///< a map that is wanted afterwards

  /// Done for its own sake and never removed; the rest is there while something needs it.
  bool kept() const { return keep || kind == StepKind::run || kind == StepKind::difference; }
};

/// One row of a group with one seed.
struct Run {
  std::string name;  ///< GROUP/ROW/seedN
  std::string group;
  std::string row;
  std::string world;  ///< the file, absolute
  std::string world_name;
  std::string sequence;
  std::string scene;      ///< in which the magnetic map was surveyed; empty: as the log
  std::string log_scene;  ///< empty: as the world says
  std::string grade;      ///< of reality; empty: as the world says
  std::optional<double> range_m;
  std::optional<double> noise_ut;
  int seed = 0;
  bool first_seed = false;
  std::vector<std::string> estimators;
  std::size_t step = 0;   ///< index in Plan::steps
  std::string folder;     ///< of its step
  std::string field;      ///< the magnetic map it ran in; there afterwards only if a figure shows it
  std::string own_field;  ///< the magnetic map that was surveyed in the log's own scene; likewise
};

/// The comparison of the map that a run used with the one of its log's own scene.
struct MapDifference {
  std::string run;
  std::size_t step = 0;
  std::string folder;
};

struct Plan {
  std::vector<Run> runs;    ///< in the order of the experiment, seeds within rows
  std::vector<Step> steps;  ///< in the order in which they are best done: drive by drive
  std::vector<MapDifference> differences;
};

/// Whether one of `names` is `pattern`, or what its wildcards * ? [] stand for.
bool fits(const std::string& pattern, const std::vector<std::string>& names);

/// Whether `pattern` means `run`: it is its name, group, row, sequence or world, the begin of its name up to a '/', or
/// one of these with the wildcards * ? [].
bool matches(const Run& run, const std::string& pattern);

/// The runs of which `figure` shows something: those of the first seed that its patterns mean, indices in `runs`.
std::vector<std::size_t> shown_runs(const FigureChoice& figure, const std::vector<Run>& runs);

/// Every run of the experiment that is among `experiment.only` (all where that is empty), without steps. Throws
/// InputError for a pattern that matches no run.
std::vector<Run> list_runs(const Experiment& experiment);

/// These runs with the steps that give their files; what several runs need is there once. Throws InputError for a
/// pattern that matches no run, or a world that cannot be read. `program`: what identifies the program that will do the
/// steps, so that another program does them again.
Plan make_plan(const Experiment& experiment, const std::string& program);

}  // namespace lodestone::reproduce
