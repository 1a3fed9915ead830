#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/plan.h"

namespace lodestone::reproduce {

/// One estimator's figures of one run: the numbers of its summary.json (nested: "stale_map.places"); true is 1, false
/// 0, null absent.
using RunFigures = std::map<std::string, double>;

/// Nothing if `figures` is null, or has no such figure.
std::optional<double> value_of(const RunFigures* figures, const std::string& name);

/// Figures of all finished runs.
class Results {
 public:
  /// Reads the summaries of the runs that are `done` (one flag per run of the plan). Throws InputError if one is
  /// broken.
  Results(const Plan& plan, const std::filesystem::path& root, const std::vector<bool>& done);

  const std::vector<Run>& runs() const { return runs_; }
  bool is_done(std::size_t run) const { return done_[run]; }

  /// Null if the run has not finished, or the estimator did not run in it.
  const RunFigures* find(std::size_t run, const std::string& estimator) const;

  /// Difference between the magnetic map of a run and the map of its log's own scene; null if they were not compared.
  const RunFigures* find_difference(std::size_t run) const;

  /// Indices of a row's runs, in the order of the seeds.
  std::vector<std::size_t> runs_of(const std::string& group, const std::string& row) const;

  /// Rows of a group, in order.
  std::vector<std::string> rows_of(const std::string& group) const;

 private:
  std::vector<Run> runs_;
  std::vector<bool> done_;
  std::vector<std::map<std::string, RunFigures>> figures_;
  std::map<std::string, RunFigures> differences_;  ///< by run
};

/// Whether a figure is meaningful even if the run lost track: success, and shares of the time within an error.
bool counts_lost_runs(const std::string& figure);

/// A figure over the seeds of a row.
struct SeedValue {
  std::size_t expected = 0;     ///< runs that should provide the value
  std::size_t present = 0;      ///< runs that provide the value
  std::size_t lost = 0;         ///< of these, runs in which the estimator lost track
  std::optional<double> value;  ///< nothing if no run provides the value
};

/// Divisor of a figure, run by run; unused if `estimator` is empty. With kBestOfOthers, the quotient is 0 if all others
/// are lost.
struct Divisor {
  std::string estimator;
  std::string figure;  ///< empty: the same figure
};

/// `figure` of `estimator` in a row, over all its seeds. The worst value is the largest, but for `success`,
/// `real_time_factor` and shares it is the smallest.
SeedValue seed_value(const Results& results, const std::string& group, const std::string& row,
                     const std::string& estimator, const std::string& figure, Statistic statistic,
                     const Divisor& over = {});

}  // namespace lodestone::reproduce
