#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/alignment.h"
#include "core/evaluation/consistency.h"

namespace lodestone {

/// The options of `lodestone evaluate`.
struct ComparisonCall {
  std::string estimate;
  std::string truth;
  std::string times;  ///< stamps of the poses of a KITTI file; empty: neither file is in KITTI's format
  std::string align = "none";
  std::vector<std::string> relations;  ///< empty: all
  double delta = 1.0;
  std::string delta_unit = "frames";
  bool all_pairs = false;
  bool interpolate = false;
  double max_difference_s = 0.01;
  std::string covariance;  ///< empty: no NEES
  std::string errors;      ///< empty: no CSV file
};

/// One row of the result: errors of one kind, in `unit`.
struct RelationErrors {
  std::string name;
  std::string unit;
  std::vector<double> errors;  ///< heading errors keep their sign
};

struct Comparison {
  std::size_t estimate_poses = 0;
  std::size_t truth_poses = 0;
  std::size_t pairs = 0;
  Alignment alignment = Alignment::none;
  Similarity similarity;  ///< applied to the estimate
  std::vector<RelationErrors> relations;
  std::optional<Consistency> consistency;
};

/// Kinds of errors, for ComparisonCall::relations.
const std::vector<std::string>& relation_names();

/// Reads the files and compares. Names are known ones. Throws InputError if a file is unusable, no stamps match, or the
/// alignment is undetermined.
Comparison compare(const ComparisonCall& call);

/// For people.
std::string to_table(const Comparison& comparison);

/// For scripts: one object with `pairs`, `alignment`, `relations.NAME.{unit,count,rmse,…}`, `nees`.
std::string to_json(const Comparison& comparison);

}  // namespace lodestone
