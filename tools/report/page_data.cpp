#include "tools/report/page_data.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

/// The shortest text of a double is what JSON holds: so rounding in decimals makes the file small.
Json parsed(const std::string& text) {
  const double value = std::strtod(text.c_str(), nullptr);
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

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t triple = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      triple = (triple << 8) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (int k = 0; k < 4; ++k) text += kLetters[(triple >> (18 - 6 * k)) & 63U];
  }
  for (std::size_t i = 0; i < (3 - bytes.size() % 3) % 3; ++i) text[text.size() - 1 - i] = '=';
  return text;
}

std::string data_uri(std::string_view media_type, std::string_view bytes) {
  return fmt::format("data:{};base64,{}", media_type, base64(bytes));
}

std::string for_script(const Json& json) {
  // Inside JSON '<' occurs in strings only, where its escape means the same. File names need not be UTF-8.
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

std::string for_html(std::string_view text) {
  std::string safe;
  for (const char letter : text) {
    switch (letter) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += letter;
    }
  }
  return safe;
}

}  // namespace lodestone
