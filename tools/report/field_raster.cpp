#include "tools/report/field_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/report/grey_png.h"

namespace lodestone {

namespace {

constexpr double kStep = 0.01;  // µT of a grey step in the stored file, unless the field is too strong for 16 bits
constexpr int kDarkest = 1;     // grey of the weakest field; 0 is no field
constexpr double kSteps16 = 65535.0 - kDarkest;
constexpr double kSteps8 = 255.0 - kDarkest;

std::filesystem::path json_beside(std::filesystem::path path) { return path.replace_extension(".json"); }

/// The raster as grey values; pictures have the largest y in their first row.
template <class Grey, class Map>
GreyImage<Grey> to_grey(const FieldRaster& raster, Map grey_of) {
  GreyImage<Grey> image{raster.columns, raster.rows, {}};
  image.values.reserve(raster.strength_ut.size());
  for (int row = raster.rows - 1; row >= 0; --row) {
    for (int column = 0; column < raster.columns; ++column) {
      const float value = raster.strength_ut[static_cast<std::size_t>(row) * raster.columns + column];
      image.values.push_back(std::isfinite(value) ? static_cast<Grey>(std::lround(kDarkest + grey_of(value))) : Grey{0});
    }
  }
  return image;
}

}  // namespace

FieldRaster rasterize(const MagneticMap& map, const PlanBox& box, double height_m, std::size_t limit) {
  const FieldGrid& grid = map.grid();
  const double x_low = std::max(box.x_low, grid.origin.x());
  const double y_low = std::max(box.y_low, grid.origin.y());
  const double x_high = std::min(box.x_high, grid.origin.x() + grid.resolution_m * (grid.columns - 1));
  const double y_high = std::min(box.y_high, grid.origin.y() + grid.resolution_m * (grid.rows - 1));
  FieldRaster raster;
  raster.height_m = height_m;
  if (!(x_high > x_low) || !(y_high > y_low)) return raster;
  raster.resolution_m = std::max(grid.resolution_m, std::sqrt((x_high - x_low) * (y_high - y_low) / static_cast<double>(limit)));
  raster.x_m = x_low;
  raster.y_m = y_low;
  // A value more would fall on the map's very edge, or beyond it by rounding.
  raster.columns = static_cast<int>((x_high - x_low) / raster.resolution_m + 1e-6) + 1;
  raster.rows = static_cast<int>((y_high - y_low) / raster.resolution_m + 1e-6) + 1;
  raster.strength_ut.reserve(static_cast<std::size_t>(raster.columns) * raster.rows);
  for (int row = 0; row < raster.rows; ++row) {
    for (int column = 0; column < raster.columns; ++column) {
      const Vector3 position{std::min(x_high, x_low + raster.resolution_m * column),
                             std::min(y_high, y_low + raster.resolution_m * row), height_m};
      const auto value = map.query(position, FieldInterpolation::bilinear);
      raster.strength_ut.push_back(value ? static_cast<float>(value->field_ut.norm()) : NAN);
    }
  }
  return raster;
}

FieldRaster coarsened(const FieldRaster& raster, std::size_t limit) {
  if (raster.strength_ut.size() <= limit) return raster;
  const int factor = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(raster.strength_ut.size()) / limit)));
  FieldRaster result = raster;
  result.columns = (raster.columns + factor - 1) / factor;
  result.rows = (raster.rows + factor - 1) / factor;
  result.resolution_m = raster.resolution_m * factor;
  result.x_m = raster.x_m + 0.5 * (factor - 1) * raster.resolution_m;
  result.y_m = raster.y_m + 0.5 * (factor - 1) * raster.resolution_m;
  const std::size_t size = static_cast<std::size_t>(result.columns) * result.rows;
  std::vector<double> sums(size, 0.0);
  std::vector<int> counts(size, 0);
  for (int row = 0; row < raster.rows; ++row) {
    for (int column = 0; column < raster.columns; ++column) {
      const float value = raster.strength_ut[static_cast<std::size_t>(row) * raster.columns + column];
      if (std::isnan(value)) continue;
      const std::size_t target = static_cast<std::size_t>(row / factor) * result.columns + column / factor;
      sums[target] += value;
      ++counts[target];
    }
  }
  result.strength_ut.assign(size, NAN);
  for (std::size_t i = 0; i < size; ++i) {
    if (counts[i] > 0) result.strength_ut[i] = static_cast<float>(sums[i] / counts[i]);
  }
  return result;
}

void write_raster(const FieldRaster& raster, const std::filesystem::path& path) {
  double strongest = 0.0;
  for (const float value : raster.strength_ut) {
    if (std::isfinite(value)) strongest = std::max(strongest, static_cast<double>(value));
  }
  const double step = std::max(kStep, strongest / kSteps16);
  const auto image = to_grey<std::uint16_t>(raster, [&](double value) { return value / step; });
  nlohmann::ordered_json json;
  json["resolution_m"] = raster.resolution_m;
  json["origin_m"] = {raster.x_m, raster.y_m};
  json["height_m"] = raster.height_m;
  json["grey_step_ut"] = step;
  json["grey_of_zero"] = kDarkest;
  write_text_file(path.string(), encode_png(image));
  write_text_file(json_beside(path).string(), json.dump(2) + "\n");
}

FieldRaster read_raster(const std::filesystem::path& path) {
  const auto image = decode_png(read_text_file(path.string()));
  if (!image) {
    throw InputError(fmt::format("{}: expected a 16-bit grey PNG, found something else; run again", path.string()));
  }
  FieldRaster raster;
  double step = 0.0;
  double zero = 0.0;
  try {
    const auto json = nlohmann::json::parse(read_text_file(json_beside(path).string()));
    raster.resolution_m = json.at("resolution_m").get<double>();
    raster.x_m = json.at("origin_m").at(0).get<double>();
    raster.y_m = json.at("origin_m").at(1).get<double>();
    raster.height_m = json.at("height_m").get<double>();
    step = json.at("grey_step_ut").get<double>();
    zero = json.at("grey_of_zero").get<double>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: {}; run again", json_beside(path).string(), error.what()));
  }
  raster.columns = image->columns;
  raster.rows = image->rows;
  for (int row = raster.rows - 1; row >= 0; --row) {
    for (int column = 0; column < raster.columns; ++column) {
      const int grey = image->values[static_cast<std::size_t>(row) * raster.columns + column];
      raster.strength_ut.push_back(grey == 0 ? NAN : static_cast<float>((grey - zero) * step));
    }
  }
  return raster;
}

RasterImage to_image(const FieldRaster& raster) {
  std::vector<float> strengths;
  std::copy_if(raster.strength_ut.begin(), raster.strength_ut.end(), std::back_inserter(strengths),
               [](float value) { return std::isfinite(value); });
  std::sort(strengths.begin(), strengths.end());
  RasterImage result;
  if (!strengths.empty()) {
    const auto quantile = [&](double share) { return strengths[static_cast<std::size_t>(share * (strengths.size() - 1.0))]; };
    result.low_ut = quantile(0.01);
    result.high_ut = quantile(0.99);
    if (result.high_ut - result.low_ut < 0.1) {
      result.low_ut -= 0.05;
      result.high_ut += 0.05;
    }
  }
  result.png = encode_png(to_grey<std::uint8_t>(raster, [&](double value) {
    return kSteps8 * std::clamp((value - result.low_ut) / (result.high_ut - result.low_ut), 0.0, 1.0);
  }));
  return result;
}

}  // namespace lodestone
