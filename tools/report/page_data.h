#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lodestone {

/// Values as a JSON array, to `digits` significant ones; null where a value is not finite. Infinity, which JSON does
/// not know either, becomes `infinite` when that is not 0.
nlohmann::ordered_json rounded(const std::vector<double>& values, int digits, double infinite = 0.0);

/// To `decimals` behind the point.
nlohmann::ordered_json with_decimals(const std::vector<double>& values, int decimals);

/// bytes as a URI that needs no network: "data:image/png;base64,…".
std::string data_uri(std::string_view media_type, std::string_view bytes);

/// JSON as text that may stand in an HTML script element: no "</script>" and no "<!--" can occur in it.
std::string for_script(const nlohmann::ordered_json& json);

/// Text that may stand in HTML.
std::string for_html(std::string_view text);

}  // namespace lodestone
