#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

namespace lodestone::reproduce {

/// Kind of a step.
enum class StepKind {
  cloud,       ///< simulate the cloud survey of a world
  log,         ///< simulate a drive
  field,       ///< simulate a survey drive and build the magnetic map from it
  run,         ///< localize a log
  difference,  ///< compare two magnetic maps
};

constexpr auto enum_names(StepKind) {
  return EnumNames<StepKind, 5>{{{StepKind::cloud, "cloud"},
                                 {StepKind::log, "log"},
                                 {StepKind::field, "field"},
                                 {StepKind::run, "run"},
                                 {StepKind::difference, "difference"}}};
}

/// One step from worlds to results: commands of the program, run one after the other.
struct Step {
  std::string name;  ///< for messages; also the name of its log file
  StepKind kind = StepKind::run;
  std::string world_name;
  std::string folder;                              ///< below the output folder; used by this step alone
  std::vector<std::vector<std::string>> commands;  ///< the program's arguments, paths relative to the output folder
  std::vector<std::string> inputs;                 ///< external files whose content counts (absolute paths)
  std::vector<std::size_t> needs;                  ///< steps that must finish before; all have smaller indices
  std::vector<std::string> intermediate;           ///< files that are removed when the step has finished
  std::size_t parts = 1;                           ///< number of estimators of a run: scales the expected time
  std::string recipe;                              ///< hash of commands, inputs and the recipes of `needs`
  std::string fingerprint;                         ///< hash of `recipe` and the program

  bool keep = false;  ///< a map that is kept after the runs

  /// Whether the step is a result that is never removed. Other steps exist only while a step needs them.
  bool kept() const { return keep || kind == StepKind::run || kind == StepKind::difference; }
};

/// One row of a group with one seed.
struct Run {
  std::string name;  ///< GROUP/ROW/seedN
  std::string group;
  std::string row;
  std::string world;  ///< file, absolute path
  std::string world_name;
  std::string sequence;
  std::string scene;      ///< in which the magnetic map was surveyed; empty: the log's
  std::string log_scene;  ///< empty: the world's default
  std::string grade;      ///< of reality; empty: the world's
  std::optional<double> range_m;
  std::optional<double> noise_ut;
  int seed = 0;
  bool first_seed = false;
  std::vector<std::string> estimators;
  std::size_t step = 0;   ///< index in Plan::steps
  std::string folder;     ///< of its step
  std::string field;      ///< the magnetic map of the run; kept only if a figure shows it
  std::string own_field;  ///< the magnetic map of the log's own scene; likewise
};

/// Comparison of a run's map with the map of its log's own scene.
struct MapDifference {
  std::string run;
  std::size_t step = 0;
  std::string folder;
};

struct Plan {
  std::vector<Run> runs;    ///< in the order of the experiment, seeds within rows
  std::vector<Step> steps;  ///< in the recommended order: drive by drive
  std::vector<MapDifference> differences;
};

/// Whether one of `names` matches `pattern`, with the wildcards * ? [].
bool fits(const std::string& pattern, const std::vector<std::string>& names);

/// Whether `pattern` selects `run`: its name, group, row, sequence or world, the beginning of its name up to a '/', or
/// one of these with the wildcards * ? [].
bool matches(const Run& run, const std::string& pattern);

/// Indices in `runs` of the runs that `figure` shows: those of the first seed that match its patterns.
std::vector<std::size_t> shown_runs(const FigureChoice& figure, const std::vector<Run>& runs);

/// The experiment's runs that match `experiment.only` (all if empty), without steps. Throws InputError for a pattern
/// without a match.
std::vector<Run> list_runs(const Experiment& experiment);

/// These runs with all steps that produce their files; common steps appear once. Throws InputError for a pattern
/// without a match, or a world that cannot be read. `program` identifies the program: steps of another program are
/// repeated.
Plan make_plan(const Experiment& experiment, const std::string& program);

}  // namespace lodestone::reproduce
