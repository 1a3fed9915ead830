#pragma once

#include <string>
#include <vector>

#include "tools/experiments/results.h"

namespace lodestone::reproduce {

/// A table of cells that are texts, for files and reports.
struct ResultTable {
  std::string name;  ///< of its files
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::string note;
};

/// A table as the experiment asks for it: the rows of its group that are meant, with what tells them apart, then its
/// columns.
/// "/": lost in at least one seed; "-": nothing published; "…": not run yet.
ResultTable make_table(const TableChoice& choice, const Experiment& experiment, const Results& results);

/// The experiment's criteria, each with the rows that meet it, what is nearest to its bound, and whether it is met.
ResultTable criteria_table(const Experiment& experiment, const Results& results);

/// One row a run and estimator with every figure: what the other tables are made of.
ResultTable runs_table(const Results& results);

}  // namespace lodestone::reproduce
