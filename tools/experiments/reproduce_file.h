#pragma once

#include "tools/experiments/results.h"
#include "tools/experiments/tables.h"

namespace lodestone::reproduce {

/// A drawn figure: paths relative to the output folder.
struct DrawnFigure {
  std::string title;
  std::string png;
  std::string pdf;
  std::string svg;
  std::string caption;
};

/// reproduce.json: {"experiment", "title", "runs": [{"name", "group", "row", "sequence", "world", "grade",
/// "range_m", "noise_ut", "scene", "seed", "folder", "estimators", "status"}], "tables": [{"title", "header", "rows",
/// "note"}], "figures": [{"title", "png", "pdf", "svg", "caption"}]}. Status: done, failed, missing.
std::string to_json(const Experiment& experiment, const Results& results, const std::vector<std::string>& status,
                    const std::vector<ResultTable>& tables, const std::vector<DrawnFigure>& figures);

}  // namespace lodestone::reproduce
