#include "tools/plotting/raster.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace lodestone::figures {

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

Raster sampled(const FieldGrid& grid, const std::function<float(const Vector3&)>& value, double height_m) {
  Raster raster{grid.resolution_m, grid.origin.x(), grid.origin.y(), grid.columns, grid.rows, {}};
  raster.values.reserve(static_cast<std::size_t>(grid.columns) * grid.rows);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      raster.values.push_back(
          value({raster.x_m + grid.resolution_m * column, raster.y_m + grid.resolution_m * row, height_m}));
    }
  }
  return raster;
}

}  // namespace

double Raster::at(double x, double y) const {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  if (columns < 2 || rows < 2) return kNothing;
  const double u = (x - x_m) / resolution_m;
  const double v = (y - y_m) / resolution_m;
  if (!(u >= 0.0 && v >= 0.0 && u <= columns - 1.0 && v <= rows - 1.0)) return kNothing;
  const int column = std::min(static_cast<int>(u), columns - 2);
  const int row = std::min(static_cast<int>(v), rows - 2);
  const auto node = [&](int i, int j) {
    return static_cast<double>(values[static_cast<std::size_t>(row + j) * columns + column + i]);
  };
  const double a = u - column;
  const double b = v - row;
  return (1.0 - b) * ((1.0 - a) * node(0, 0) + a * node(1, 0)) + b * ((1.0 - a) * node(0, 1) + a * node(1, 1));
}

double Raster::quantile(double share) const {
  std::vector<float> known;
  for (const float value : values) {
    if (std::isfinite(value)) known.push_back(value);
  }
  if (known.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto place = known.begin() + static_cast<std::ptrdiff_t>(share * (static_cast<double>(known.size()) - 1.0));
  std::nth_element(known.begin(), place, known.end());
  return *place;
}

Raster strength_raster(const MagneticMap& map, double height_m) {
  return sampled(map.grid(), [&](const Vector3& point) {
    const auto value = map.query(point, FieldInterpolation::bilinear);
    return value ? static_cast<float>(value->field_ut.norm()) : kNone;
  }, height_m);
}

Raster difference_raster(const MagneticMap& reference, const MagneticMap& other, double height_m) {
  return sampled(other.grid(), [&](const Vector3& point) {
    const auto there = reference.query(point, FieldInterpolation::bilinear);
    const auto here = other.query(point, FieldInterpolation::bilinear);
    return there && here ? static_cast<float>((there->field_ut - here->field_ut).norm()) : kNone;
  }, height_m);
}

}  // namespace lodestone::figures
