#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace lodestone {

/// Values as a JSON array with `digits` significant digits; null for values that are not finite. Infinity becomes
/// `infinite` if that is not 0.
nlohmann::ordered_json rounded(const std::vector<double>& values, int digits, double infinite = 0.0);

/// The same with `decimals` decimals.
nlohmann::ordered_json with_decimals(const std::vector<double>& values, int decimals);

/// Bytes as a URI without network access: "data:image/png;base64,…".
std::string data_uri(std::string_view media_type, std::string_view bytes);

/// JSON text that is safe in an HTML script element: contains neither "</script>" nor "<!--".
std::string escape_script(const nlohmann::ordered_json& json);

/// Escapes text for HTML.
std::string escape_html(std::string_view text);

}  // namespace lodestone
