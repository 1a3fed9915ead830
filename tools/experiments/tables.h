#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/experiments/results.h"

namespace lodestone::reproduce {

/// A table of text cells, for files and reports.
struct ResultTable {
  std::string name;  ///< of its files
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string note;
};

/// Cells instead of a number.
inline constexpr const char* kLost = "/";
inline constexpr const char* kNothing = "-";
inline constexpr const char* kMissing = "…";

/// A number with `digits` decimals, or kNothing.
std::string number_cell(const std::optional<double>& value, int digits);

/// A table as defined in the experiment: the selected rows of its group with their distinguishing labels, then its
/// columns. "/": lost with at least one seed; "-": nothing published; "…": not run yet.
ResultTable make_table(const TableChoice& choice, const Experiment& experiment, const Results& results);

/// The experiment's criteria: rows that meet each, the row closest to its bound, and the result.
ResultTable criteria_table(const Experiment& experiment, const Results& results);

/// One row per run and estimator with all figures: the data of the other tables.
ResultTable runs_table(const Results& results);

}  // namespace lodestone::reproduce
