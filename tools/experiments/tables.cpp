#include "tools/experiments/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "frontends/configuration/options.h"

namespace lodestone::reproduce {

namespace {

std::string title_of(const TableColumn& column) {
  if (!column.title.empty()) return column.title;
  if (!column.published.empty()) return column.published;
  if (!column.difference.empty()) return "change of the map, " + column.difference;
  const std::string over = column.over.empty() ? "" : " / " + column.over;
  return fmt::format("{}{} {} {}", column.estimator, over, column.figure,
                     options_detail::write_value(column.statistic));
}

/// Distinguishes the rows of a group. A column is shown if any row has a value; with `differing`, if two rows differ.
struct RowLabel {
  const char* title;
  std::string (*text)(const Run&);
  bool differing = false;
};

const RowLabel kLabels[] = {
    {"world", [](const Run& run) { return run.world_name; }},
    {"sequence", [](const Run& run) { return run.sequence; }},
    {"range m", [](const Run& run) { return run.range_m ? fmt::format("{:g}", *run.range_m) : std::string(); }},
    {"noise µT", [](const Run& run) { return run.noise_ut ? fmt::format("{:g}", *run.noise_ut) : std::string(); }},
    {"map of", [](const Run& run) { return run.scene; }},
    {"grade", [](const Run& run) { return run.grade; }, true},
};

std::string difference_cell(const TableColumn& column, const Group& group, const std::string& row,
                            const Results& results) {
  for (const std::size_t run : results.runs_of(group.name, row)) {
    const std::optional<double> value = value_of(results.find_difference(run), column.difference);
    if (value) return number_cell(value, column.digits);
  }
  return kMissing;
}

std::string cell(const TableColumn& column, const Group& group, const std::string& row, const Results& results) {
  if (!column.published.empty()) {
    const PublishedValue* value = group.published.find(row, column.published);
    return value != nullptr ? value->text : kNothing;
  }
  if (!column.difference.empty()) return difference_cell(column, group, row, results);
  const SeedValue seeds = seed_value(results, column.group.empty() ? group.name : column.group, row, column.estimator,
                                     column.figure, column.statistic, {column.over, column.over_figure});
  if (seeds.expected == 0) return kNothing;
  if (seeds.present == 0) return kMissing;
  if (column.figure == "success") return fmt::format("{}/{}", seeds.present - seeds.lost, seeds.present);
  return seeds.lost > 0 && !counts_lost_runs(column.figure) ? kLost : number_cell(seeds.value, column.digits);
}

}  // namespace

std::string number_cell(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : kNothing;
}

ResultTable make_table(const TableChoice& choice, const Experiment& experiment, const Results& results) {
  const Group& group = *experiment.find_group(choice.group);
  ResultTable table{choice.name, choice.title, {}, {}, choice.note};
  const std::vector<std::string> rows = results.rows_of(group.name);
  const auto first_run = [&](const std::string& row) -> const Run& {
    return results.runs()[results.runs_of(group.name, row).front()];
  };
  std::vector<const RowLabel*> labels;
  for (const RowLabel& label : kLabels) {
    std::set<std::string> values;
    for (const std::string& row : rows) values.insert(label.text(first_run(row)));
    values.erase("");
    if (values.size() < (label.differing ? 2 : 1)) continue;
    labels.push_back(&label);
    table.header.emplace_back(label.title);
  }
  for (const TableColumn& column : choice.columns) table.header.push_back(title_of(column));
  for (const std::string& row : rows) {
    std::vector<std::string> cells;
    for (const RowLabel* label : labels) cells.push_back(label->text(first_run(row)));
    for (const TableColumn& column : choice.columns) cells.push_back(cell(column, group, row, results));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

ResultTable runs_table(const Results& results) {
  ResultTable table{"runs", "Every run", {"run", "estimator"}, {}, ""};
  const std::vector<std::string>& names = figure_names();
  table.header.insert(table.header.end(), names.begin(), names.end());
  for (std::size_t i = 0; i < results.runs().size(); ++i) {
    for (const std::string& estimator : results.runs()[i].estimators) {
      const RunFigures* figures = results.find(i, estimator);
      if (figures == nullptr) continue;
      std::vector<std::string> cells{results.runs()[i].name, estimator};
      for (const std::string& name : names) {
        const std::optional<double> value = value_of(figures, name);
        cells.push_back(value ? fmt::format("{}", *value) : "");
      }
      table.rows.push_back(std::move(cells));
    }
  }
  return table;
}

}  // namespace lodestone::reproduce
