#include "tools/report/page_data.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "frontends/configuration/number_text.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

/// JSON contains the shortest text of a double, so that rounding to decimals makes the file small.
Json parsed(const std::string& text) {
  double value = 0.0;
  parse_number(text, value);
  if (value == std::floor(value) && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
  return value;
}

}  // namespace

Json rounded(const std::vector<double>& values, int digits, double infinite) {
  Json array = Json::array();
  for (const double value : values) {
    if (std::isfinite(value)) {
      array.push_back(parsed(fmt::format("{:.{}g}", value, digits)));
    } else {
      array.push_back(std::isinf(value) && infinite != 0.0 ? Json(infinite) : Json(nullptr));
    }
  }
  return array;
}

Json with_decimals(const std::vector<double>& values, int decimals) {
  Json array = Json::array();
  for (const double value : values) {
    array.push_back(std::isfinite(value) ? parsed(fmt::format("{:.{}f}", value, decimals)) : Json(nullptr));
  }
  return array;
}

std::string escape_script(const Json& json) {
  // In JSON, '<' occurs only in strings, where its escape is equivalent. File names may be invalid UTF-8.
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char letter : text) {
    if (letter == '<') {
      safe += "\\u003c";
    } else {
      safe += letter;
    }
  }
  return safe;
}

}  // namespace lodestone
