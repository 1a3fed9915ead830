#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mapping/magnetic_map_builder.h"

namespace lodestone {

/// What speaks against a survey and its trajectory belonging together, in one line with the likely causes; empty where
/// nothing does. Readings scatter about any map that they can make far more than the magnetometers' noise lets them:
/// wrong poses put different fields in one place. `reading_noise_ut`: of one reading, as the platform says. Doubtful is
/// - a cell's noise above three times that of a reading;
/// - one above a reading's, and three times what the likelihood says without a second pass;
/// - held-out cells missed by more than three of their sigmas (rms).
std::string survey_doubts(const FieldKernelFit& fit, double reading_noise_ut,
                          const std::optional<HeldOutScore>& held_out);

/// The layers of `map` above or below all readings, in which no place of a reading has field: in one line, with the
/// heights that the readings have; empty where there are none such.
std::string unreached_heights(const std::vector<FieldObservation>& readings, const MagneticMap& map);

/// What mostly makes a survey contradict itself.
extern const char* const kSurveyCauses;

}  // namespace lodestone
