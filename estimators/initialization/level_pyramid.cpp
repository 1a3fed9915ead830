#include "estimators/initialization/level_pyramid.h"

#include <algorithm>

namespace lodestone {

namespace {

/// The or of each value with those `step` columns and then `step` rows further.
std::vector<std::uint32_t> or_shifted(const std::vector<std::uint32_t>& bits, int columns, int rows, int step) {
  std::vector<std::uint32_t> result = bits;
  const auto width = static_cast<std::size_t>(columns);
  const auto ahead = static_cast<std::size_t>(step);
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
    std::uint32_t* values = result.data() + row * width;
    for (std::size_t column = 0; column + ahead < width; ++column) values[column] |= values[column + ahead];
  }
  for (std::size_t row = 0; row + ahead < static_cast<std::size_t>(rows); ++row) {
    std::uint32_t* values = result.data() + row * width;
    for (std::size_t column = 0; column < width; ++column) values[column] |= values[column + ahead * width];
  }
  return result;
}

}  // namespace

LevelPyramid::LevelPyramid(const SiteLevel& level, int depth) {
  std::vector<std::uint32_t> full = level.cells;  // windows of 2^k cells, from every cell
  for (int k = 0; k <= depth; ++k) {
    if (k > 0) full = or_shifted(full, level.columns, level.rows, 1 << (k - 1));
    Layer layer;
    layer.shift = std::max(0, k - 2);
    const int step = 1 << layer.shift;
    layer.columns = (level.columns + step - 1) / step;
    layer.rows = (level.rows + step - 1) / step;
    // A window may begin anywhere between two stored ones, so stored windows are wider by that distance.
    const std::vector<std::uint32_t> wide =
        step > 1 ? or_shifted(full, level.columns, level.rows, step - 1) : std::vector<std::uint32_t>{};
    const std::vector<std::uint32_t>& source = step > 1 ? wide : full;
    layer.bits.reserve(static_cast<std::size_t>(layer.columns) * static_cast<std::size_t>(layer.rows));
    for (int row = 0; row < level.rows; row += step) {
      for (int column = 0; column < level.columns; column += step)
        layer.bits.push_back(source[level.index(column, row)]);
    }
    layers_.push_back(std::move(layer));
  }
}

}  // namespace lodestone
