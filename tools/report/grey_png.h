#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lodestone {

/// Grey values row by row, the upper row first.
template <class Value>
struct GreyImage {
  int columns = 0;
  int rows = 0;
  std::vector<Value> values;
};

/// The image as the bytes of a PNG file. 16 bits are stored as they are (linear), 8 bits as a screen shows them (sRGB).
/// Throws std::runtime_error where there is no memory for it.
std::string encode_png(const GreyImage<std::uint16_t>& image);
std::string encode_png(const GreyImage<std::uint8_t>& image);

/// A 16-bit grey PNG; nothing where the bytes are something else.
std::optional<GreyImage<std::uint16_t>> decode_png(const std::string& bytes);

}  // namespace lodestone
