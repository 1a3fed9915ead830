#pragma once

#include <fstream>
#include <string>

#include "tests/tools/program_runner.h"

namespace lodestone::reproduce {

/// A world that takes a second: a yard with one box, two drives, and a cart that is present on one day.
inline constexpr const char* kYard = R"(
name: yard
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 128}
  magnetometer_mounts:
    - {name: front, position_m: [0.3, 0.2, -0.08]}
    - {name: rear, position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
survey: {lateral_offsets_m: [0.0]}
cloud: {point_spacing_m: 0.07}
solids:
  - {shape: box, at_m: [0, 0, 2], size_m: [20, 12, 4], steel: [{kind: rods, from_m: [-9, -5, -2.6], to_m: [9, 5, -2.4],
     density_per_m2: 1, length_m: [0.5, 1.0], moment_sigma_a_m2: 10}]}
  - {shape: box, at_m: [0, 4, 1], size_m: [2, 2, 2]}
scenes:
  monday: {solids: [{name: cart, shape: box, at_m: [2, -3, 0.5], size_m: [1, 1, 1],
                     steel: [{kind: dipole, at_m: [0, 0, 0], moment_sigma_a_m2: 60}]}]}
sequences:
  out: {waypoints_m: [[-3, 0], [3, 0]], speed: [[0, 1.5]]}
  back: {waypoints_m: [[3, 0.2], [-3, 0.2]], speed: [[0, 1.5]]}
)";

inline constexpr const char* kYardExperiment = R"(
name: yard
seeds: [1, 2]
estimators: [smoother, {name: ieskf, seeds: first}]
groups:
  ways:
    drives: [{world: yard.yaml, sequences: [out]}]
    ranges_m: [30, 5]
    published:
      methods: [theirs]
      rows: {yard-out-30m: [0.5], yard-out-5m: ["/"]}
  days:
    drives: [{world: yard.yaml, sequences: [back], scene: none, map_scenes: [none, monday]}]
    seeds: first
tables:
  - {name: ways, title: "ATE, 100 %", group: ways, columns: [{published: theirs}, {estimator: smoother},
     {estimator: ieskf},
     {estimator: smoother, over: ieskf, digits: 2}, {estimator: smoother, figure: success}]}
  - {name: days, group: days, columns: [{difference: largest_ut, digits: 2}, {estimator: smoother}]}
criteria:
  - {title: reaches the end, kind: at_least, group: ways, estimator: smoother, figure: success, limit: 1}
  - {title: as good as theirs, group: ways, estimator: smoother, published: theirs}
  - {title: impossible, group: ways, estimator: smoother, limit: 0}
figures:
  - {kind: error_grid, name: error, runs: [ways]}
  - {kind: error_distribution, name: distribution, runs: [ways, days]}
  - {kind: map_difference, name: changes, runs: [days]}
  - {kind: world_overview, name: worlds, runs: [ways, days]}
quick: {seeds: [1], duration_s: 3, only: [ways/yard-out-30m]}
)";

/// Writes both files into `folder` and returns the experiment's path.
inline std::string write_yard(const TemporaryFolder& folder, const std::string& experiment = kYardExperiment) {
  std::ofstream(folder / "yard.yaml") << kYard;
  std::ofstream(folder / "experiment.yaml") << experiment;
  return (folder / "experiment.yaml").string();
}

}  // namespace lodestone::reproduce
