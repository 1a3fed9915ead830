#pragma once

#include <limits>

#include "tools/plotting/canvas.h"

namespace lodestone {

/// A stretch of the floor plan, map x and y in metres; empty until something is included.
struct PlanStretch {
  double x_low = std::numeric_limits<double>::infinity();
  double x_high = -std::numeric_limits<double>::infinity();
  double y_low = std::numeric_limits<double>::infinity();
  double y_high = -std::numeric_limits<double>::infinity();

  double width() const { return x_high - x_low; }
  double height() const { return y_high - y_low; }

  bool contains(double x, double y) const { return x >= x_low && x <= x_high && y >= y_low && y <= y_high; }

  void include(double x, double y);

  /// Adds surroundings: `share` of the longer side, at least `least_m`. What is empty becomes two metres about the
  /// origin.
  void widen(double least_m, double share);

  /// As wide and high as a box of this ratio, about the same middle: metres stay metres both ways.
  PlanStretch filling(double width_over_height) const;
};

/// Where a plan stands on its sheet, metres alike both ways: where the box is wider or higher than the stretch that was
/// asked for, it shows more of its surroundings.
struct PlanSheet {
  PlanStretch stretch;
  CanvasBox box;
  double width = 0.0;  ///< of the whole sheet, with room for axes and a colour bar
  double height = 0.0;
  int x_ticks = 0;
  int y_ticks = 0;

  CanvasBox color_bar() const { return {box.right + 30.0, box.top + 24.0, box.right + 52.0, box.bottom}; }
  double x_at(double canvas_x) const;  ///< map x of a point of the canvas
  double y_at(double canvas_y) const;
};

/// `top`: height of what stands above the plan.
PlanSheet plan_sheet(const PlanStretch& stretch, double top);

}  // namespace lodestone
