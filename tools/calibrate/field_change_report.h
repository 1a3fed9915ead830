#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimators/calibration/field_change.h"

namespace lodestone {

/// Difference to the map that all magnetometers share, for the terminal; empty without a map.
std::string field_change_text(const FieldChange& change);

/// The same as JSON.
nlohmann::ordered_json field_change_json(const FieldChange& change);

/// The compared places as CSV, one per line.
std::string field_change_csv(const FieldChange& change);

}  // namespace lodestone
