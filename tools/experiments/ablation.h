#pragma once

#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

/// Ablations: the same drives with one or several switches set differently, compared pair by pair
/// (docs/user/ablations.md).
namespace lodestone::ablation {

/// One key that a variant sets: an option of `lodestone run`; `map.KEY`, an option of `map magnetic`; `world.KEY`, a
/// key of the world; `noise_ut`, the field noise of the log, µT; or `estimator`.
struct Switch {
  std::string key;
  std::string value;  ///< as written
};

struct Variant {
  std::string name;
  std::vector<Switch> switches;  ///< common ones of all variants, then its own; no key twice

  /// Null where this variant does not set the key.
  const Switch* find(const std::string& key) const;
};

struct Ablation : reproduce::RunScope {
  std::string file;
  std::string name;  ///< of the tables' files
  std::string title;
  std::string note;
  std::string estimator = "smoother";  ///< of variants without an estimator
  std::size_t baseline = 0;            ///< index in `variants`
  std::vector<Variant> variants;       ///< at least two, all different
  std::vector<reproduce::Drive> drives;
  std::vector<double> ranges_m;

  /// Keys that some variant sets, in the order of the file.
  std::vector<std::string> keys() const;
};

/// The file of an ablation: a path, or a name in config/ablations. Throws InputError that lists the known names.
std::string find_ablation(const std::string& name);

/// Reads an ablation; with `quick`, its section `quick` replaces values. Throws InputError with file, line, key and
/// correction; unknown keys are errors, also those of switches.
Ablation load_ablation(const std::string& path, bool quick);

/// All combinations of a grid's values, in file order, the last key varying fastest. A variant's name is the last part
/// of each key with its value ("rule=paper mask=soft"), or the whole key if two names would be equal. Throws InputError
/// if a key has no values, or a value is no scalar.
std::vector<Variant> expand_grid(const ConfigurationNode& grid);

/// A variant for each value of each key, with this one switch and named "KEY=VALUE". Throws as expand_grid().
std::vector<Variant> expand_each(const ConfigurationNode& each);

/// Value of `key` in the runs of this variant: the variant's value, else the default; empty if the world determines it.
std::string effective_value(const Ablation& ablation, const Variant& variant, const std::string& key);

/// Folder-safe text that identifies the variant's runs by their settings, independent of variant and ablation:
/// "smoother", "smoother+degeneracy.rule=none".
std::string recipe_name(const Ablation& ablation, const Variant& variant);

/// The ablation's runs: one group per variant, named by recipe_name().
reproduce::Experiment to_experiment(const Ablation& ablation);

}  // namespace lodestone::ablation
