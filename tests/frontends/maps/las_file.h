#pragma once

#include <cstdint>
#include <cstring>
#include <string>

#include "core/geometry/so3.h"

namespace lodestone::testing {

/// What a test varies of a LAS file.
struct LasFile {
  int minor = 2;
  int format = 0;
  std::size_t point_bytes = 20;
  std::uint32_t announced = 0;  ///< 32-bit number of points
  std::uint64_t announced_long = 0;
  double scale = 0.001;
  Vector3 offset = Vector3::Zero();
  std::string points{};

  std::string bytes() const {
    const std::size_t own = minor == 4 ? 375 : 227;
    std::string header(own, '\0');
    const auto put = [&header](std::size_t at, const auto& value) { std::memcpy(&header[at], &value, sizeof(value)); };
    std::memcpy(header.data(), "LASF", 4);
    header[24] = 1;
    header[25] = static_cast<char>(minor);
    put(94, static_cast<std::uint16_t>(own));
    put(96, static_cast<std::uint32_t>(own + 10));  // ten bytes of a variable-length record
    header[104] = static_cast<char>(format);
    put(105, static_cast<std::uint16_t>(point_bytes));
    put(107, announced);
    for (int row = 0; row < 3; ++row) {
      put(131 + 8 * static_cast<std::size_t>(row), scale);
      put(155 + 8 * static_cast<std::size_t>(row), offset[row]);
    }
    if (minor == 4) put(247, announced_long);
    return header + std::string(10, '\x7F') + points;
  }

  void add(std::int32_t x, std::int32_t y, std::int32_t z, int flags = 0, int kind = 0) {
    std::string point(point_bytes, '\0');
    std::memcpy(&point[0], &x, 4);
    std::memcpy(&point[4], &y, 4);
    std::memcpy(&point[8], &z, 4);
    point[15] = static_cast<char>(flags);
    if (format >= 6) point[16] = static_cast<char>(kind);
    points += point;
  }
};

}  // namespace lodestone::testing
