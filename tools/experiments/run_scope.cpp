#include "tools/experiments/run_scope.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "tools/experiments/yaml_parts.h"

namespace lodestone::reproduce {

namespace {

std::vector<int> read_seeds(const ConfigurationNode& node) {
  std::vector<int> seeds;
  for (const ConfigurationNode& element : node.elements()) {
    const int seed = element.as_int();
    if (seed < 0) element.fail("a seed must not be below 0");
    if (std::find(seeds.begin(), seeds.end(), seed) != seeds.end()) element.fail("the seed appears twice");
    seeds.push_back(seed);
  }
  if (seeds.empty()) node.fail("expected at least one seed");
  return seeds;
}

void lay_over(const ConfigurationNode& node, RunScope& scope) {
  if (const ConfigurationNode* seeds = node.find("seeds")) scope.seeds = read_seeds(*seeds);
  if (node.has("only")) scope.only = texts(node, "only");
  if (const ConfigurationNode* duration = node.find("duration_s")) {
    scope.duration_s = duration->as_double();
    if (!(*scope.duration_s > 0.0)) duration->fail("expected seconds above 0");
  }
}

}  // namespace

RunScope read_scope(const ConfigurationNode& root, bool quick) {
  RunScope scope;
  lay_over(root, scope);
  const ConfigurationNode* section = root.find("quick");
  if (section == nullptr) {
    if (quick) throw InputError(root.file() + ": --quick requires the section 'quick', which is missing");
    return scope;
  }
  section->refuse_keys_other_than({"seeds", "only", "duration_s"});
  RunScope shortened = scope;
  lay_over(*section, shortened);
  return quick ? shortened : scope;
}

void override_scope(RunScope& scope, const std::vector<std::string>& only, const std::vector<int>& seeds) {
  if (!only.empty()) scope.only = only;
  if (!seeds.empty()) scope.seeds = seeds;
  for (const int seed : scope.seeds) {
    if (seed < 0 || std::count(scope.seeds.begin(), scope.seeds.end(), seed) > 1) {
      throw InputError(
          fmt::format("--seeds: expected different whole numbers from 0, found {}", fmt::join(scope.seeds, ",")));
    }
  }
}

}  // namespace lodestone::reproduce
