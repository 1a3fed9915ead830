#pragma once

#include "tests/tools/experiments/experiment_files.h"

namespace lodestone::ablation {

inline constexpr const char* kYardAblation = R"(
name: yard
title: "Switches in a yard"
baseline: as shipped
variants:
  as shipped: {}
  no mask: {degeneracy.rule: none}
  one magnetometer: {magnetic.magnetometers: 1}
drives: [{world: yard.yaml, sequences: [out]}]
ranges_m: [30, 5]
seeds: [1, 2]
quick: {seeds: [1], duration_s: 3, only: [yard-out-30m]}
)";

/// Writes world and ablation into `folder` and returns the ablation's path.
inline std::string write_yard(const TemporaryFolder& folder, const std::string& ablation = kYardAblation) {
  std::ofstream(folder / "yard.yaml") << reproduce::kYard;
  std::ofstream(folder / "ablation.yaml") << ablation;
  return (folder / "ablation.yaml").string();
}

/// kYardAblation with `from` replaced by `to`.
inline std::string changed(const std::string& from, const std::string& to) {
  std::string text = kYardAblation;
  EXPECT_NE(text.find(from), std::string::npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace lodestone::ablation
