#include "tools/experiments/switches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/error.h"
#include "core/mapping/magnetic_map_builder.h"
#include "estimators/factory.h"
#include "estimators/options.h"
#include "frontends/configuration/options.h"
#include "tools/run/fingerprint.h"

namespace lodestone::ablation {

namespace {

constexpr std::string_view kMap = "map.";
constexpr std::string_view kWorld = "world.";
constexpr const char* kNoise = "noise_ut";
constexpr const char* kEstimator = "estimator";

/// The order in the file does not affect a run. Sorted switches give identical commands.
std::vector<Switch> by_key(std::vector<Switch> switches) {
  std::sort(switches.begin(), switches.end(), [](const Switch& a, const Switch& b) { return a.key < b.key; });
  return switches;
}

template <class Options>
Options options_with(const std::vector<std::string>& settings) {
  Options options;
  load_options(load_configuration({}, settings), options);
  return options;
}

/// The value of `path` (parts joined by dots) among all options, as text.
template <class Options>
std::string value_of(const Options& options, std::string_view path) {
  const ConfigurationNode all = ConfigurationNode::parse(save_options(options), "options");
  const ConfigurationNode* node = &all;
  for (std::string_view rest = path; !rest.empty();) {
    const std::size_t dot = std::min(rest.find('.'), rest.size());
    node = &node->at(std::string(rest.substr(0, dot)));
    rest.remove_prefix(std::min(dot + 1, rest.size()));
  }
  if (node->kind() == ConfigurationNode::Kind::scalar) return node->as_string();
  std::string list;
  for (const ConfigurationNode& element : node->elements()) {
    if (!list.empty()) list += ' ';
    list += element.as_string();
  }
  return list;
}

}  // namespace

const Switch* Variant::find(const std::string& key) const {
  const auto found = std::find_if(switches.begin(), switches.end(), [&](const Switch& one) { return one.key == key; });
  return found == switches.end() ? nullptr : &*found;
}

std::vector<std::string> Ablation::keys() const {
  std::vector<std::string> keys;
  for (const Variant& variant : variants) {
    for (const Switch& one : variant.switches) {
      reproduce::place_of(one.key, keys);
    }
  }
  return keys;
}

SortedSwitches sort_switches(const std::vector<Switch>& switches) {
  SortedSwitches sorted;
  for (const Switch& one : by_key(switches)) {
    const std::string setting = one.key + "=" + one.value;
    if (one.key == kEstimator) {
      sorted.estimator = one.value;
    } else if (one.key == kNoise) {
      ConfigurationNode value;
      value.set(setting);
      sorted.noise_ut = value.at(kNoise).as_double();
      if (!(*sorted.noise_ut >= 0.0)) throw InputError(fmt::format("{}: noise must not be below 0 µT", kNoise));
    } else if (one.key.starts_with(kMap)) {
      sorted.map.push_back(setting.substr(kMap.size()));
    } else if (one.key.starts_with(kWorld)) {
      sorted.world.push_back(setting.substr(kWorld.size()));
    } else {
      sorted.run.push_back(setting);
    }
  }
  return sorted;
}

void check_switches(const std::vector<Switch>& switches) {
  const SortedSwitches sorted = sort_switches(switches);
  options_with<RunOptions>(sorted.run);
  options_with<MagneticMapOptions>(sorted.map);
  const std::vector<std::string> known = estimator_names();
  if (!sorted.estimator.empty() && std::find(known.begin(), known.end(), sorted.estimator) == known.end()) {
    throw InputError(fmt::format("there is no estimator '{}'{} (known: {})", sorted.estimator,
                                 suggestion(sorted.estimator, known), join_names(known)));
  }
}

std::string effective_value(const Ablation& ablation, const Variant& variant, const std::string& key) {
  const Switch* own = variant.find(key);
  if (key == kNoise || key.starts_with(kWorld)) return own != nullptr ? own->value : "";
  if (key == kEstimator) return own != nullptr ? own->value : ablation.estimator;
  const SortedSwitches sorted = sort_switches(variant.switches);
  if (key.starts_with(kMap)) return value_of(options_with<MagneticMapOptions>(sorted.map), key.substr(kMap.size()));
  return value_of(options_with<RunOptions>(sorted.run), key);
}

std::string recipe_name(const Ablation& ablation, const Variant& variant) {
  constexpr std::size_t kLongest = 120;
  const Switch* estimator = variant.find(kEstimator);
  std::string name = estimator != nullptr ? estimator->value : ablation.estimator;
  for (const Switch& one : by_key(variant.switches)) {
    if (one.key != kEstimator) name += "+" + one.key + "=" + one.value;
  }
  std::string safe;
  for (const unsigned char letter : name) {
    const bool good =
        std::isalnum(letter) != 0 || std::string_view("-_.+=").find(static_cast<char>(letter)) != std::string::npos;
    safe += good ? static_cast<char>(letter) : '_';
  }
  if (safe == name && name.size() <= kLongest) return name;
  return safe.substr(0, kLongest) + "-" + Fingerprint().add(name).to_string().substr(0, 8);
}

reproduce::Experiment to_experiment(const Ablation& ablation) {
  reproduce::Experiment experiment;
  static_cast<reproduce::RunScope&>(experiment) = ablation;
  experiment.only.clear();  // they are names of variants, which an experiment does not have
  experiment.file = ablation.file;
  experiment.name = ablation.name;
  experiment.title = ablation.title;
  for (const Variant& variant : ablation.variants) {
    const SortedSwitches sorted = sort_switches(variant.switches);
    reproduce::Group group;
    group.name = recipe_name(ablation, variant);
    group.drives = ablation.drives;
    group.ranges_m = ablation.ranges_m;
    group.noise_ut = sorted.noise_ut;
    group.estimators = {{sorted.estimator.empty() ? ablation.estimator : sorted.estimator}};
    group.world_settings = sorted.world;
    group.map_settings = sorted.map;
    group.run_settings = sorted.run;
    experiment.groups.push_back(std::move(group));
  }
  return experiment;
}

}  // namespace lodestone::ablation
