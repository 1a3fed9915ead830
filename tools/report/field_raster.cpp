#include "tools/report/field_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/plotting/png.h"

namespace lodestone {

namespace {

constexpr double kStep = 0.01;  // µT per grey step in the file, unless the field is too strong for 16 bits
constexpr int kDarkest = 1;     // grey of the weakest field; 0 is no field
constexpr double kSteps16 = 65535.0 - kDarkest;
constexpr double kSteps8 = 255.0 - kDarkest;

std::filesystem::path json_beside(std::filesystem::path path) {
  return path.replace_extension(".json");
}

/// kDarkest for `low_ut` and below, one more for each step. The first row of a picture has the largest y.
cv::Mat to_grey(const cv::Mat1f& strength_ut, int type, double low_ut, double step_ut) {
  cv::Mat grey;
  strength_ut.convertTo(grey, type, 1.0 / step_ut, kDarkest - low_ut / step_ut);
  grey = cv::max(grey, kDarkest);
  grey.setTo(0, without_value(strength_ut));
  cv::flip(grey, grey, 0);
  return grey;
}

}  // namespace

void write_raster(const PlanRaster& strength, const std::filesystem::path& path) {
  const double strongest = quantile(strength.values, 1.0);
  const double step = std::isfinite(strongest) ? std::max(kStep, strongest / kSteps16) : kStep;
  nlohmann::ordered_json json;
  json["resolution_m"] = strength.resolution_m;
  json["origin_m"] = {strength.x_m, strength.y_m};
  json["height_m"] = strength.height_m;
  json["grey_step_ut"] = step;
  json["grey_of_zero"] = kDarkest;
  write_text_file(path, encode_png(to_grey(strength.values, CV_16U, 0.0, step)));
  write_text_file(json_beside(path), json.dump(2) + "\n");
}

PlanRaster read_raster(const std::filesystem::path& path) {
  const cv::Mat grey = decode_png(read_text_file(path.string()));
  if (grey.type() != CV_16UC1 || grey.empty()) {
    throw InputError(fmt::format("{}: expected a 16-bit grey PNG; repeat the run", path.string()));
  }
  PlanRaster raster;
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
    throw InputError(fmt::format("{}: {}; repeat the run", json_beside(path).string(), error.what()));
  }
  grey.convertTo(raster.values, CV_32F, step, -zero * step);
  raster.values.setTo(NAN, grey == 0);
  cv::flip(raster.values, raster.values, 0);
  return raster;
}

RasterImage to_image(const PlanRaster& strength) {
  const Scale scale = strength_scale(strength.values);
  RasterImage result{"", scale.low, scale.high};
  result.png = encode_png(to_grey(strength.values, CV_8U, result.low_ut, (result.high_ut - result.low_ut) / kSteps8));
  return result;
}

}  // namespace lodestone
