#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimators/calibration/field_change.h"

namespace lodestone {

/// What all magnetometers share against the map, for the terminal; empty without a map.
std::string field_change_text(const FieldChange& change);

/// The same as JSON.
nlohmann::ordered_json field_change_json(const FieldChange& change);

/// The places, one a line, as CSV.
std::string field_change_csv(const FieldChange& change);

}  // namespace lodestone
