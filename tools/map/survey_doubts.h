#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mapping/magnetic_map_builder.h"

namespace lodestone {

/// Signs that a survey and its trajectory do not belong together, in one line with the likely causes; empty if there
/// are none. Wrong poses put different fields at one place. `reading_noise_ut`: of one reading, from the platform.
/// Signs:
/// - a cell's noise above three times that of a reading;
/// - a cell's noise above that of a reading and above three times the likelihood's noise without a second pass;
/// - normalized errors of held-out cells above three (rms).
std::string survey_doubts(const FieldKernelFit& fit, double reading_noise_ut,
                          const std::optional<HeldOutScore>& held_out);

/// The layers of `map` above or below all readings, without field at any reading's place: in one line, with the
/// readings' heights; empty if there are none.
std::string unreached_heights(const std::vector<FieldObservation>& readings, const MagneticMap& map);

/// Most common causes of contradictions within a survey.
extern const char* const kSurveyCauses;

}  // namespace lodestone
