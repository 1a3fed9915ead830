#pragma once

#include <string>
#include <vector>

#include "tools/experiments/experiment.h"

/// Ablations: the same drives with one switch or several set differently, compared pair by pair
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
  std::vector<Switch> switches;  ///< those common to all variants, then its own; no key twice

  /// Null where this variant does not set the key.
  const Switch* find(const std::string& key) const;
};

struct Ablation : reproduce::RunScope {
  std::string file;
  std::string name;  ///< of the tables
  std::string title;
  std::string note;
  std::string estimator = "smoother";  ///< of variants that name none
  std::size_t baseline = 0;            ///< index in `variants`
  std::vector<Variant> variants;       ///< at least two, all different
  std::vector<reproduce::Drive> drives;
  std::vector<double> ranges_m;

  /// Keys that some variant sets, in the order of the file.
  std::vector<std::string> keys() const;
};

/// The file of an ablation: a path, or the name of one in config/ablations. Throws InputError that names the known
/// ones.
std::string find_ablation(const std::string& name);

/// Reads an ablation; with `quick` its section `quick` is laid over it. Throws InputError with file, line, key and what
/// to change; unknown keys are errors, those of switches too.
Ablation load_ablation(const std::string& path, bool quick);

/// Every combination of the values of a grid, in the order of the file, the last key running fastest. A variant's name
/// is the last part of each key with its value ("rule=paper mask=soft"), or the whole key where two would look alike.
/// Throws InputError where a key has no values, or a value is no scalar.
std::vector<Variant> expand_grid(const ConfigurationNode& grid);

/// What `key` is worth in a run of this variant: as it sets it, else the default; empty where that is the world's.
std::string effective_value(const Ablation& ablation, const Variant& variant, const std::string& key);

/// Folder-safe text that tells the variant's runs from others by what they are run with, whatever variant or ablation
/// they belong to: "smoother", "smoother+degeneracy.rule=none".
std::string recipe_name(const Ablation& ablation, const Variant& variant);

/// The ablation's runs: a group a variant, by its recipe name.
reproduce::Experiment to_experiment(const Ablation& ablation);

}  // namespace lodestone::ablation
