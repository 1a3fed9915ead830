#include "tools/plotting/plan_sheet.h"

#include <algorithm>

#include "tools/plotting/axes.h"

namespace lodestone {

void PlanExtent::include(double x, double y) {
  x_low = std::min(x_low, x);
  x_high = std::max(x_high, x);
  y_low = std::min(y_low, y);
  y_high = std::max(y_high, y);
}

void PlanExtent::widen(double least_m, double share) {
  if (!(x_high >= x_low)) *this = {-1.0, 1.0, -1.0, 1.0};
  const double margin = std::max(least_m, share * std::max(width(), height()));
  *this = {x_low - margin, x_high + margin, y_low - margin, y_high + margin};
}

PlanExtent PlanExtent::filling(double width_over_height) const {
  const double wide = std::max(width(), height() * width_over_height);
  const double high = wide / width_over_height;
  const double x = 0.5 * (x_low + x_high);
  const double y = 0.5 * (y_low + y_high);
  return {x - 0.5 * wide, x + 0.5 * wide, y - 0.5 * high, y + 0.5 * high};
}

double PlanSheet::x_at(double canvas_x) const {
  return extent.x_low + (canvas_x - box.left) / box.width() * extent.width();
}

double PlanSheet::y_at(double canvas_y) const {
  return extent.y_high - (canvas_y - box.top) / box.height() * extent.height();
}

PlanSheet plan_sheet(const PlanExtent& extent, double top) {
  constexpr double kWidth = 1200.0;
  constexpr double kLeastWidth = 500.0;
  constexpr double kMostHeight = 1000.0;
  constexpr double kLeastHeight = 260.0;
  const double wide = extent.width();
  const double high = extent.height();
  const double pixels_a_metre = std::min(kWidth / wide, kMostHeight / high);
  const double width = std::max(kLeastWidth, wide * pixels_a_metre);
  const double height = std::max(kLeastHeight, high * pixels_a_metre);
  const double spare_x = 0.5 * (width / pixels_a_metre - wide);
  const double spare_y = 0.5 * (height / pixels_a_metre - high);

  PlanSheet sheet;
  sheet.extent = {extent.x_low - spare_x, extent.x_high + spare_x, extent.y_low - spare_y, extent.y_high + spare_y};
  sheet.x_ticks = static_cast<int>(width / 110.0);
  sheet.y_ticks = std::max(2, static_cast<int>(height / 80.0));
  std::size_t letters = 0;
  for (const double y : round_ticks(sheet.extent.y_low, sheet.extent.y_high, sheet.y_ticks)) {
    letters = std::max(letters, tick_text(y).size());
  }
  const double left = std::max(100.0, 42.0 + 9.0 * static_cast<double>(letters));  // georeferenced y is long
  sheet.box = {left, top, left + width, top + height};
  sheet.width = sheet.box.right + 120.0;
  sheet.height = sheet.box.bottom + 70.0;
  return sheet;
}

}  // namespace lodestone
