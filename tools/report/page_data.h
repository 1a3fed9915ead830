#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace lodestone {

/// Values as a JSON array with `digits` significant digits; null for values that are not finite. Infinity becomes
/// `infinite` if that is not 0.
nlohmann::ordered_json rounded(const std::vector<double>& values, int digits, double infinite = 0.0);

/// The same with `decimals` decimals.
nlohmann::ordered_json with_decimals(const std::vector<double>& values, int decimals);

/// JSON text that is safe in an HTML script element: contains neither "</script>" nor "<!--".
std::string escape_script(const nlohmann::ordered_json& json);

}  // namespace lodestone
