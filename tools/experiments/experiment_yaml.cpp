// Reads experiment files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/nearest_name.h"
#include "estimators/factory.h"
#include "frontends/configuration/options.h"
#include "tools/experiments/experiment.h"
#include "tools/experiments/plan.h"
#include "tools/experiments/repeated_entries.h"
#include "tools/experiments/yaml_parts.h"
#include "tools/simulate/world_queries.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

template <class Enum>
Enum choice(const ConfigurationNode& node, const std::string& key, Enum value) {
  if (const ConfigurationNode* child = node.find(key)) options_detail::read_value(*child, value);
  return value;
}

std::vector<EstimatorChoice> read_estimators(const ConfigurationNode& list) {
  std::vector<EstimatorChoice> estimators;
  for (const ConfigurationNode& element : list.elements()) {
    EstimatorChoice estimator;
    if (element.kind() == ConfigurationNode::Kind::scalar) {
      estimator.name = element.as_string();
    } else {
      load_options(element, estimator);
    }
    require_known(element, estimator.name, estimator_names(), "estimator");
    for (const EstimatorChoice& other : estimators) {
      if (other.name == estimator.name) element.fail(fmt::format("'{}' appears twice", estimator.name));
    }
    estimators.push_back(estimator);
  }
  if (estimators.empty()) list.fail("expected at least one estimator");
  return estimators;
}

PublishedValue read_published_value(const ConfigurationNode& node) {
  PublishedValue value{node.as_string(), {}};
  if (value.text != "/" && value.text != "-") value.value = node.as_double();
  return value;
}

void read_published(const ConfigurationNode& node, Group& group) {
  node.refuse_keys_other_than({"methods", "rows"});
  group.published.methods = texts(node, "methods");
  const ConfigurationNode& rows = node.at("rows");
  const std::vector<std::string> known = row_names(group);
  for (const std::string& name : rows.keys()) {
    const ConfigurationNode& row = rows.at(name);
    require_known(row, name, known, "row");
    for (const ConfigurationNode& value : row.elements())
      group.published.rows[name].push_back(read_published_value(value));
    if (group.published.rows[name].size() != group.published.methods.size()) {
      row.fail(fmt::format("expected {} values, one a method ({}), found {}", group.published.methods.size(),
                           join_names(group.published.methods), group.published.rows[name].size()));
    }
  }
}

Group read_group(const ConfigurationNode& node, const std::string& name,
                 const std::vector<EstimatorChoice>& estimators) {
  node.refuse_keys_other_than({"drives", "ranges_m", "noise_ut", "grade", "seeds", "estimators", "world_settings",
                               "map_settings", "run_config", "run_settings", "bound", "published"});
  Group group;
  group.name = name;
  read_drives(node, group.drives);
  group.ranges_m = read_ranges(node);
  if (const ConfigurationNode* noise = node.find("noise_ut")) {
    group.noise_ut = noise->as_double();
    if (!(*group.noise_ut >= 0.0)) noise->fail("noise must not be below 0 µT");
  }
  const std::string grade = read_grade(node);
  for (Drive& drive : group.drives) {
    if (drive.grade.empty()) drive.grade = grade;
  }
  group.seeds = choice(node, "seeds", group.seeds);
  const ConfigurationNode* own = node.find("estimators");
  group.estimators = own != nullptr ? read_estimators(*own) : estimators;
  if (group.estimators.empty())
    node.fail("no estimators: name them here, or for all groups under the key 'estimators'");
  group.world_settings = texts(node, "world_settings");
  group.map_settings = texts(node, "map_settings");
  if (const ConfigurationNode* config = node.find("run_config")) {
    group.run_config = path_beside(*config);
    if (!fs::exists(group.run_config)) config->fail(fmt::format("there is no file {}", group.run_config));
  }
  group.run_settings = texts(node, "run_settings");
  if (const ConfigurationNode* bound = node.find("bound")) group.bound = bound->as_bool();
  check_rows(node, group);
  if (const ConfigurationNode* published = node.find("published")) read_published(*published, group);
  return group;
}

std::vector<std::string> names_of(const std::vector<Group>& groups) {
  std::vector<std::string> names;
  for (const Group& group : groups) names.push_back(group.name);
  return names;
}

std::vector<std::string> names_of(const std::vector<EstimatorChoice>& estimators) {
  std::vector<std::string> names;
  for (const EstimatorChoice& estimator : estimators) names.push_back(estimator.name);
  return names;
}

/// The group that `node` names under `group`.
const Group& group_of(const ConfigurationNode& node, const Experiment& experiment) {
  const ConfigurationNode& name = node.at("group");
  require_known(name, name.as_string(), names_of(experiment.groups), "group");
  return *experiment.find_group(name.as_string());
}

/// Checks the references of a column or criterion against its group.
void check_references(const ConfigurationNode& node, const Group& group, const std::string& estimator,
                      const std::string& over, const std::string& published, const std::string& figure) {
  if (!estimator.empty()) require_known(node, estimator, names_of(group.estimators), "estimator");
  if (!over.empty() && over != kBestOfOthers) require_known(node, over, names_of(group.estimators), "estimator");
  if (!published.empty()) require_known(node, published, group.published.methods, "published method");
  require_known(node, figure, figure_names(), "figure");
}

TableChoice read_table(const ConfigurationNode& node, const Experiment& experiment) {
  node.refuse_keys_other_than({"name", "title", "group", "note", "columns"});
  TableChoice table;
  table.name = file_name(node.at("name"));
  table.title = text(node, "title", table.name);
  table.note = text(node, "note");
  const Group& group = group_of(node, experiment);
  table.group = group.name;
  for (const ConfigurationNode& element : node.at("columns").elements()) {
    TableColumn column;
    load_options(element, column);
    const int kinds =
        (column.estimator.empty() ? 0 : 1) + (column.published.empty() ? 0 : 1) + (column.difference.empty() ? 0 : 1);
    if (kinds != 1) element.fail("expected one of 'estimator', 'published' and 'difference'");
    if (!column.difference.empty())
      require_known(element, column.difference, difference_names(), "figure of a difference");
    if (column.digits < 0 || column.digits > 12) element.fail("expected 0 to 12 digits");
    const bool own = column.group.empty() || column.estimator.empty();
    if (!column.group.empty() && own) element.fail("'group' requires 'estimator'");
    check_references(element, own ? group : group_of(element, experiment), column.estimator, column.over,
                     column.published, column.figure);
    if (!column.over_figure.empty()) require_known(element, column.over_figure, figure_names(), "figure");
    table.columns.push_back(column);
  }
  return table;
}

Criterion read_criterion(const ConfigurationNode& node, const Experiment& experiment) {
  node.refuse_keys_other_than({"title", "kind", "group", "estimator", "figure", "statistic", "limit", "published",
                               "over", "over_figure", "only", "factor", "rows"});
  Criterion criterion;
  criterion.title = node.at("title").as_string();
  criterion.kind = choice(node, "kind", criterion.kind);
  const Group& group = group_of(node, experiment);
  criterion.group = group.name;
  criterion.estimator = node.at("estimator").as_string();
  criterion.figure = text(node, "figure", criterion.figure);
  criterion.statistic = choice(node, "statistic", criterion.statistic);
  if (const ConfigurationNode* limit = node.find("limit")) criterion.limit = limit->as_double();
  criterion.published = text(node, "published");
  criterion.over = text(node, "over");
  criterion.over_figure = text(node, "over_figure");
  criterion.only = texts(node, "only");
  for (const std::string& pattern : criterion.only) {
    const std::vector<std::string> rows = row_names(group);
    if (std::none_of(rows.begin(), rows.end(), [&](const std::string& row) { return fits(pattern, {row}); })) {
      node.at("only").fail(
          fmt::format("no row of '{}' matches '{}'{}", group.name, pattern, suggestion(pattern, rows)));
    }
  }
  if (const ConfigurationNode* factor = node.find("factor")) criterion.factor = factor->as_double();
  if (const ConfigurationNode* rows = node.find("rows")) criterion.rows = rows->as_int();
  const int bounds =
      (criterion.limit ? 1 : 0) + (criterion.published.empty() ? 0 : 1) + (criterion.over.empty() ? 0 : 1);
  if (bounds != 1) node.fail("expected one bound: 'limit', 'published' or 'over'");
  if (criterion.kind == CriterionKind::spread && !criterion.limit) node.fail("a spread requires 'limit'");
  if (criterion.kind == CriterionKind::median && !criterion.published.empty()) {
    node.fail("a median has one bound for all rows: expected 'limit' or 'over', found 'published'");
  }
  check_references(node, group, criterion.estimator, criterion.over, criterion.published, criterion.figure);
  if (!criterion.over_figure.empty()) require_known(node, criterion.over_figure, figure_names(), "figure");
  return criterion;
}

FigureChoice read_figure(const ConfigurationNode& node) {
  node.refuse_keys_other_than({"kind", "name", "title", "caption", "runs", "estimators"});
  FigureChoice figure;
  node.at("kind");
  figure.kind = choice(node, "kind", figure.kind);
  figure.name = file_name(node.at("name"));
  figure.title = text(node, "title", figure.name);
  figure.caption = text(node, "caption");
  figure.runs = texts(node, "runs");
  figure.estimators = texts(node, "estimators");
  for (const std::string& name : figure.estimators) require_known(node, name, estimator_names(), "estimator");
  return figure;
}

template <class Read>
auto read_list(const ConfigurationNode& root, const std::string& key, Read read) {
  std::vector<decltype(read(root))> list;
  if (const ConfigurationNode* node = root.find(key)) {
    std::set<std::string> names;
    for (const ConfigurationNode& element : repeated_entries(*node)) {
      list.push_back(read(element));
      const ConfigurationNode* name = element.find("name");
      if (name != nullptr && !names.insert(name->as_string()).second) name->fail("the name appears twice");
    }
  }
  return list;
}

}  // namespace

Experiment load_experiment(const std::string& path, bool quick) {
  const ConfigurationNode root = ConfigurationNode::load(path);
  root.refuse_keys_other_than({"name", "title", "seeds", "only", "duration_s", "estimators", "groups", "tables",
                               "criteria", "figures", "quick"});
  Experiment experiment;
  experiment.file = path;
  experiment.name = root.has("name") ? file_name(root.at("name")) : fs::path(path).stem().string();
  experiment.title = text(root, "title", experiment.name);
  static_cast<RunScope&>(experiment) = read_scope(root, quick);
  const ConfigurationNode* common = root.find("estimators");
  const std::vector<EstimatorChoice> estimators =
      common != nullptr ? read_estimators(*common) : std::vector<EstimatorChoice>{};
  const ConfigurationNode& groups = root.at("groups");
  for (const auto& [name, group] : repeated_groups(groups)) {
    check_file_name(group, name);
    if (experiment.find_group(name) != nullptr) group.fail(fmt::format("the group '{}' appears twice", name));
    experiment.groups.push_back(read_group(group, name, estimators));
  }
  if (experiment.groups.empty()) groups.fail("expected at least one group of runs");
  experiment.tables =
      read_list(root, "tables", [&](const ConfigurationNode& node) { return read_table(node, experiment); });
  experiment.criteria =
      read_list(root, "criteria", [&](const ConfigurationNode& node) { return read_criterion(node, experiment); });
  experiment.figures = read_list(root, "figures", read_figure);
  return experiment;
}

}  // namespace lodestone::reproduce
