// Reads ablation files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/error.h"
#include "estimators/factory.h"
#include "tools/experiments/ablation.h"
#include "tools/experiments/switches.h"
#include "tools/experiments/yaml_parts.h"
#include "tools/shipped_files.h"

namespace lodestone::ablation {

namespace {

/// Adds a switch, or replaces the switch with the same key.
void add_or_replace(const Switch& one, std::vector<Switch>& switches) {
  const auto found =
      std::find_if(switches.begin(), switches.end(), [&](const Switch& other) { return other.key == one.key; });
  if (found != switches.end()) {
    found->value = one.value;
  } else {
    switches.push_back(one);
  }
}

std::vector<Switch> read_switches(const ConfigurationNode& node) {
  std::vector<Switch> switches;
  for (const std::string& key : node.keys()) switches.push_back({key, node.at(key).as_string()});
  return switches;
}

/// --only separates patterns by commas, and tables have variant names in their headers.
void check_variant_name(const ConfigurationNode& node, const std::string& name) {
  if (name.empty() || name.find_first_of(",/\n*?[") != std::string::npos) {
    node.fail(fmt::format("'{}' is not allowed: a variant's name must not contain , / * ? [", name));
  }
}

std::string last_part(const std::string& key) {
  return key.substr(key.rfind('.') + 1);
}

/// A variant with one more switch for each value in the list under `key`; `shown`: the key in its name.
std::vector<Variant> with_each_value(const Variant& variant, const ConfigurationNode& node, const std::string& key,
                                     const std::string& shown) {
  if (node.at(key).elements().empty()) node.at(key).fail("expected a list of values");
  std::vector<Variant> result;
  for (const ConfigurationNode& value : node.at(key).elements()) {
    Variant next = variant;
    next.name += fmt::format("{}{}={}", next.name.empty() ? "" : " ", shown, value.as_string());
    check_variant_name(value, next.name);
    next.switches.push_back({key, value.as_string()});
    result.push_back(std::move(next));
  }
  return result;
}

std::vector<Variant> read_variants(const ConfigurationNode& root, const Ablation& ablation) {
  std::vector<Switch> common;
  if (const ConfigurationNode* settings = root.find("settings")) common = read_switches(*settings);
  std::vector<Variant> variants;
  std::vector<const ConfigurationNode*> places;
  if (const ConfigurationNode* list = root.find("variants")) {
    for (const std::string& name : list->keys()) {
      check_variant_name(list->at(name), name);
      variants.push_back({name, read_switches(list->at(name))});
      places.push_back(&list->at(name));
    }
  }
  const auto add = [&](const ConfigurationNode& place, std::vector<Variant> expanded) {
    for (Variant& variant : expanded) variants.push_back(std::move(variant));
    places.resize(variants.size(), &place);
  };
  if (const ConfigurationNode* grid = root.find("grid")) add(*grid, expand_grid(*grid));
  if (const ConfigurationNode* each = root.find("each")) add(*each, expand_each(*each));
  if (variants.size() < 2) root.fail("expected at least two variants, under the key 'variants', 'grid' or 'each'");
  std::map<std::string, std::string> recipes;
  std::set<std::string> names;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    std::vector<Switch> switches = common;
    for (const Switch& one : variants[i].switches) add_or_replace(one, switches);
    variants[i].switches = std::move(switches);
    try {
      check_switches(variants[i].switches);
    } catch (const InputError& error) {
      places[i]->fail(fmt::format("variant '{}': {}", variants[i].name, error.what()));
    }
    if (!names.insert(variants[i].name).second)
      places[i]->fail(fmt::format("the variant '{}' appears twice", variants[i].name));
    const auto [other, is_new] = recipes.try_emplace(recipe_name(ablation, variants[i]), variants[i].name);
    if (!is_new)
      places[i]->fail(fmt::format("variants '{}' and '{}' set the same values", other->second, variants[i].name));
  }
  return variants;
}

}  // namespace

std::string find_ablation(const std::string& name) {
  return find_shipped("ablations", "ablation", name);
}

std::vector<Variant> expand_grid(const ConfigurationNode& grid) {
  std::map<std::string, int> uses;
  for (const std::string& key : grid.keys()) ++uses[last_part(key)];
  std::vector<Variant> variants(1);
  for (const std::string& key : grid.keys()) {
    const std::string shown = uses.at(last_part(key)) > 1 ? key : last_part(key);
    std::vector<Variant> more;
    for (const Variant& variant : variants) {
      for (Variant& next : with_each_value(variant, grid, key, shown)) more.push_back(std::move(next));
    }
    variants = std::move(more);
  }
  return variants;
}

std::vector<Variant> expand_each(const ConfigurationNode& each) {
  std::vector<Variant> variants;
  for (const std::string& key : each.keys()) {
    for (Variant& next : with_each_value({}, each, key, key)) variants.push_back(std::move(next));
  }
  return variants;
}

Ablation load_ablation(const std::string& path, bool quick) {
  using reproduce::text;
  const ConfigurationNode root = ConfigurationNode::load(path);
  root.refuse_keys_other_than({"name", "title", "note", "estimator", "baseline", "settings", "variants", "grid", "each",
                               "drives", "ranges_m", "seeds", "only", "duration_s", "quick"});
  Ablation ablation;
  static_cast<reproduce::RunScope&>(ablation) = reproduce::read_scope(root, quick);
  ablation.file = path;
  ablation.name =
      root.has("name") ? reproduce::file_name(root.at("name")) : std::filesystem::path(path).stem().string();
  ablation.title = text(root, "title", ablation.name);
  ablation.note = text(root, "note");
  ablation.estimator = text(root, "estimator", ablation.estimator);
  if (const ConfigurationNode* estimator = root.find("estimator")) {
    reproduce::require_known(*estimator, ablation.estimator, estimator_names(), "estimator");
  }
  reproduce::read_drives(root, ablation.drives);
  if (ablation.drives.empty()) root.at("drives").fail("expected at least one drive");
  ablation.ranges_m = reproduce::read_ranges(root);
  reproduce::Group rows;
  rows.drives = ablation.drives;
  rows.ranges_m = ablation.ranges_m;
  reproduce::check_rows(root, rows);
  ablation.variants = read_variants(root, ablation);
  std::vector<std::string> names;
  for (const Variant& variant : ablation.variants) names.push_back(variant.name);
  const ConfigurationNode& baseline = root.at("baseline");
  reproduce::require_known(baseline, baseline.as_string(), names, "variant");
  ablation.baseline =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), baseline.as_string()) - names.begin());
  return ablation;
}

}  // namespace lodestone::ablation
