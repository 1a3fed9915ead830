#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tools/plotting/canvas.h"
#include "tools/plotting/plan_raster.h"

namespace lodestone {

namespace {

constexpr int kColors = 256;

/// The colours of one of OpenCV's maps, mixed with a share of white.
cv::Mat3b opencv_colors(int opencv_map, double white) {
  cv::Mat1b shares(kColors, 1);
  for (int i = 0; i < kColors; ++i) shares(i) = static_cast<unsigned char>(i);
  cv::Mat colors;
  cv::applyColorMap(shares, colors, opencv_map);
  colors.convertTo(colors, -1, 1.0 - white, 255.0 * white);
  return colors;
}

/// Interpolates evenly spaced colours, given as red, green, blue.
cv::Mat3b interpolate_colors(const std::vector<cv::Vec3b>& steps) {
  const int last = static_cast<int>(steps.size()) - 1;
  cv::Mat3b colors(kColors, 1);
  for (int i = 0; i < kColors; ++i) {
    const double place = static_cast<double>(last) * i / (kColors - 1);
    const int low = std::min(static_cast<int>(place), last - 1);
    const cv::Vec3d mixed = cv::Vec3d(steps[low]) * (low + 1 - place) + cv::Vec3d(steps[low + 1]) * (place - low);
    colors(i) = cv::Vec3b(cv::Vec3d(mixed[2], mixed[1], mixed[0]));
  }
  return colors;
}

/// Blue, green, red for the shares 0, 1/255, ... 1.
const cv::Mat3b& color_table(ColorRamp ramp) {
  // Viridis and plasma: Smith and van der Walt 2015. The reds are ColorBrewer's OrRd, beginning with white.
  static const std::array<cv::Mat3b, 5> tables{opencv_colors(cv::COLORMAP_VIRIDIS, 0.4),
                                               interpolate_colors({{255, 255, 255},
                                                                   {254, 232, 200},
                                                                   {253, 187, 132},
                                                                   {252, 141, 89},
                                                                   {227, 74, 51},
                                                                   {179, 0, 0},
                                                                   {100, 0, 20}}),
                                               interpolate_colors({{250, 250, 250}, {90, 90, 90}}),
                                               interpolate_colors({{232, 232, 232}, {174, 174, 174}}),
                                               opencv_colors(cv::COLORMAP_PLASMA, 0.0)};
  return tables[static_cast<std::size_t>(ramp)];
}

}  // namespace

Color series_color(std::size_t index) {
  static constexpr std::array<Color, 11> kSeries{{{213, 94, 0},
                                                  {0, 114, 178},
                                                  {0, 158, 115},
                                                  {204, 121, 167},
                                                  {230, 159, 0},
                                                  {86, 180, 233},
                                                  {120, 94, 60},
                                                  {130, 60, 160},
                                                  {150, 150, 40},
                                                  {90, 90, 90},
                                                  {20, 130, 130}}};
  return kSeries[index % kSeries.size()];
}

Color color_of(ColorRamp ramp, double share) {
  const auto index = static_cast<int>(std::lround((kColors - 1) * std::clamp(share, 0.0, 1.0)));
  const cv::Vec3b color = color_table(ramp)(index);
  return {color[2], color[1], color[0]};
}

cv::Mat4b colored(const cv::Mat1f& shares, ColorRamp ramp) {
  cv::Mat indices;
  shares.convertTo(indices, CV_8U, kColors - 1);
  cv::Mat image;
  cv::applyColorMap(indices, image, color_table(ramp));
  cv::cvtColor(image, image, cv::COLOR_BGR2BGRA);
  image.setTo(cv::Scalar::all(0), without_value(shares));
  return image;
}

}  // namespace lodestone
