#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/options.h"
#include "tools/experiments/run_scope.h"

/// Experiments: worlds, drives, maps, estimators and the reported tables and figures, as described in a YAML file
/// (docs/user/reproduce.md). No code depends on the name of a world, a drive or a method.
namespace lodestone::reproduce {

/// The seeds for which something is done.
enum class SeedChoice { all, first };

constexpr auto enum_names(SeedChoice) {
  return EnumNames<SeedChoice, 2>{{{SeedChoice::all, "all"}, {SeedChoice::first, "first"}}};
}

struct EstimatorChoice {
  std::string name;
  SeedChoice seeds = SeedChoice::all;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("name", name, "as for `lodestone run --estimator`");
    visitor.field("seeds", seeds, "the seeds with which it runs");
  }
};

/// One drive of one world, with the scenes in which its magnetic maps are surveyed.
struct Drive {
  std::string world;       ///< file, absolute path
  std::string world_name;  ///< stem of the file
  std::string sequence;
  std::string scene;                    ///< of the log; empty: the world's default
  std::vector<std::string> map_scenes;  ///< one row per scene; empty: one map, surveyed in the log's own scene
  std::string grade;                    ///< of reality (--reality of simulate); empty: the world's
};

/// A figure as given in a paper: its text and, unless it is lost or absent, its value.
struct PublishedValue {
  std::string text;
  std::optional<double> value;
};

/// Published values for the rows of a group.
struct Published {
  std::vector<std::string> methods;
  std::map<std::string, std::vector<PublishedValue>> rows;  ///< by row name, one value per method

  /// Null if there is no value.
  const PublishedValue* find(const std::string& row, const std::string& method) const;
};

/// Runs of one kind: every drive × range × map scene is a row; every row runs with every seed.
struct Group {
  std::string name;
  std::vector<Drive> drives;
  std::vector<double> ranges_m;    ///< LiDAR ranges; empty: the platform's
  std::optional<double> noise_ut;  ///< of the log's magnetometers; nothing: the world's, as for all maps
  SeedChoice seeds = SeedChoice::all;
  std::vector<EstimatorChoice> estimators;
  std::vector<std::string> world_settings;  ///< --set of simulate
  std::vector<std::string> map_settings;    ///< --set of map magnetic
  std::string run_config;                   ///< --config of run, absolute path; empty: none
  std::vector<std::string> run_settings;    ///< --set of run
  bool bound = false;                       ///< --bound of run: ATE / bound of each stage
  Published published;
};

/// The value of the seeds that a cell shows.
enum class Statistic { mean, worst };

constexpr auto enum_names(Statistic) {
  return EnumNames<Statistic, 2>{{{Statistic::mean, "mean"}, {Statistic::worst, "worst"}}};
}

/// As an estimator's name in `over`: the other estimator of the run with the smallest figure that is not lost.
inline constexpr const char* kBestOfOthers = "others";

/// A column of a table: a published method, a figure of an estimator (or its ratio to another estimator's), or the
/// difference between the field maps of the row and of the log's own scene.
struct TableColumn {
  std::string title;
  std::string published;
  std::string estimator;
  std::string group;  ///< whose row of the same name is shown; empty: the table's
  std::string over;   ///< estimator whose figure, of the same run, is the divisor; kBestOfOthers
  std::string figure = "ate_m";
  std::string over_figure;  ///< of `over`; empty: `figure`
  std::string difference;   ///< figure of diff.json, the comparison of maps
  Statistic statistic = Statistic::mean;
  int digits = 4;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("title", title, "header; default: made from the other keys");
    visitor.field("published", published, "method whose published figures are shown");
    visitor.field("estimator", estimator, "estimator whose figures are shown");
    visitor.field("group", group, "group whose row of the same name is shown; default: the table's");
    visitor.field("over", over, "estimator whose figure of the same run is the divisor; others: the best of them");
    visitor.field("figure", figure, "key of the estimator's summary.json");
    visitor.field("over_figure", over_figure, "key of the summary.json of 'over'; default: the same figure");
    visitor.field("difference", difference, "key of diff.json of the row's map_difference, with the first seed");
    visitor.field("statistic", statistic, "over the seeds");
    visitor.field("digits", digits, "decimals");
  }
};

struct TableChoice {
  std::string name;
  std::string title;
  std::string group;
  std::string note;
  std::vector<TableColumn> columns;
};

enum class CriterionKind {
  at_most,   ///< figure ≤ bound
  at_least,  ///< figure ≥ bound
  spread,    ///< largest over smallest of the rows, less 1, ≤ limit
  median,    ///< median of the rows' figures ≤ bound
};

constexpr auto enum_names(CriterionKind) {
  return EnumNames<CriterionKind, 4>{{{CriterionKind::at_most, "at_most"},
                                      {CriterionKind::at_least, "at_least"},
                                      {CriterionKind::spread, "spread"},
                                      {CriterionKind::median, "median"}}};
}

/// A criterion for the rows of a group. The bound is `limit`, or the row's published figure times `factor`, or another
/// estimator's figure of the same run times `factor`.
struct Criterion {
  std::string title;
  CriterionKind kind = CriterionKind::at_most;
  std::string group;
  std::string estimator;
  std::string figure = "ate_m";
  Statistic statistic = Statistic::worst;
  std::optional<double> limit;
  std::string published;
  std::string over;
  std::string over_figure;        ///< of `over`; empty: `figure`
  std::vector<std::string> only;  ///< rows, with wildcards; empty: all rows of the group
  double factor = 1.0;
  std::optional<int> rows;  ///< number of rows that must meet it; nothing: all
};

enum class FigureKind {
  error_grid,          ///< error over time: one panel per row of runs, with all estimators
  error_distribution,  ///< share of scans within an error: one panel per world, or per grade of reality if there are
                       ///< several
  map_difference,      ///< |ΔB| between the maps of a drive's scenes and the map of the log's own scene
  field_residual,      ///< measured minus map along the trajectory
  world_overview,      ///< cloud and paths, one panel per world
};

constexpr auto enum_names(FigureKind) {
  return EnumNames<FigureKind, 5>{{{FigureKind::error_grid, "error_grid"},
                                   {FigureKind::error_distribution, "error_distribution"},
                                   {FigureKind::map_difference, "map_difference"},
                                   {FigureKind::field_residual, "field_residual"},
                                   {FigureKind::world_overview, "world_overview"}}};
}

struct FigureChoice {
  FigureKind kind = FigureKind::error_grid;
  std::string name;  ///< of the files
  std::string title;
  std::string caption;
  std::vector<std::string> runs;        ///< patterns; the first seed of each row is drawn
  std::vector<std::string> estimators;  ///< empty: those of the runs
};

struct Experiment : RunScope {
  std::string file;
  std::string name;
  std::string title;
  std::vector<Group> groups;
  std::vector<TableChoice> tables;
  std::vector<Criterion> criteria;
  std::vector<FigureChoice> figures;

  const Group* find_group(const std::string& name) const;
};

/// WORLD-SEQUENCE[-RANGEm][-NOISEut][-SCENE].
std::string row_name(const std::string& world, const std::string& sequence, std::optional<double> range_m,
                     std::optional<double> noise_ut, const std::string& scene);

/// One LiDAR range and one map of a drive.
struct Row {
  std::string name;
  std::optional<double> range_m;  ///< nothing: the platform's
  std::string scene;              ///< empty: the log's own
};
std::vector<Row> rows_of(const Group& group, const Drive& drive);

/// Index of `text` in `texts`; a new text is appended.
std::size_t place_of(const std::string& text, std::vector<std::string>& texts);

/// Names of the rows of all drives of `group`, in order.
std::vector<std::string> row_names(const Group& group);

/// The file of an experiment, by its path or its name in config/experiments (tools/shipped_files.h).
std::string find_experiment(const std::string& name);

/// Reads an experiment; with `quick`, its section `quick` (seeds, duration_s, only) replaces values. Throws InputError
/// with file, line, key and correction; unknown keys, groups, rows, estimators and methods are errors.
Experiment load_experiment(const std::string& path, bool quick);

/// Figures of summary.json that tables and criteria can refer to.
const std::vector<std::string>& figure_names();

/// Figures of diff.json that tables can refer to.
const std::vector<std::string>& difference_names();

}  // namespace lodestone::reproduce
