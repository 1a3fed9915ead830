#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lodestone {

/// One field of a point in a file.
struct PointFieldLayout {
  std::string name;
  char type = 'F';          ///< F, I or U, as in PCD
  int size = 4;             ///< bytes
  std::int64_t offset = 0;  ///< from the point's first byte
};

/// The layout of a PCD file with uncompressed binary data.
struct PcdLayout {
  std::vector<PointFieldLayout> fields;
  std::int64_t point_bytes = 0;
  std::int64_t points = 0;
  std::int64_t data_offset = 0;  ///< of the first point in the file
};

/// Reads a PCD header. Nothing if the data are not uncompressed binary, or if the header is unusual.
std::optional<PcdLayout> read_binary_pcd_layout(const std::string& path);

}  // namespace lodestone
