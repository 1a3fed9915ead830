#pragma once

#include "core/options.h"

namespace lodestone::simulation {

/// Size of the differences between a simulated robot with its maps and the user's description of them. Each grade is a
/// column of the table in config/worlds/README.md, section Reality.
enum class RealityGrade { exact, calibrated, field, rough };

constexpr auto enum_names(RealityGrade) {
  return EnumNames<RealityGrade, 4>{{{RealityGrade::exact, "exact"},
                                     {RealityGrade::calibrated, "calibrated"},
                                     {RealityGrade::field, "field"},
                                     {RealityGrade::rough, "rough"}}};
}

}  // namespace lodestone::simulation
