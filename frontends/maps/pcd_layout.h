#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lodestone {

/// One field of a point as a file stores it.
struct PointFieldLayout {
  std::string name;
  char type = 'F';          ///< F, I or U, as PCD has it
  int size = 4;             ///< bytes
  std::int64_t offset = 0;  ///< from the point's first byte
};

/// Where a PCD file with uncompressed binary data has its points.
struct PcdLayout {
  std::vector<PointFieldLayout> fields;
  std::int64_t point_bytes = 0;
  std::int64_t points = 0;
  std::int64_t data_offset = 0;  ///< of the first point in the file
};

/// Reads a PCD's header. Nothing where the data are not uncompressed binary, or the header is out of the ordinary.
std::optional<PcdLayout> read_binary_pcd_layout(const std::string& path);

}  // namespace lodestone
