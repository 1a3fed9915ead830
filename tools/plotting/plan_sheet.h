#pragma once

#include <limits>

#include "tools/plotting/canvas.h"

namespace lodestone {

/// A rectangle of the floor plan, map x and y in metres; empty until something is included.
struct PlanExtent {
  double x_low = std::numeric_limits<double>::infinity();
  double x_high = -std::numeric_limits<double>::infinity();
  double y_low = std::numeric_limits<double>::infinity();
  double y_high = -std::numeric_limits<double>::infinity();

  double width() const { return x_high - x_low; }
  double height() const { return y_high - y_low; }

  bool contains(double x, double y) const { return x >= x_low && x <= x_high && y >= y_low && y <= y_high; }

  void include(double x, double y);

  /// Adds a margin: `share` of the longer side, at least `least_m`. An empty rectangle becomes two metres around the
  /// origin.
  void widen(double least_m, double share);

  /// Enlarges the rectangle to this aspect ratio, with the same centre.
  PlanExtent filling(double width_over_height) const;
};

/// The place of a plan on its sheet, with equal scales of x and y. If the box has another aspect ratio than the
/// requested rectangle, the plan shows more of the surroundings.
struct PlanSheet {
  PlanExtent extent;
  CanvasBox box;
  double width = 0.0;  ///< of the whole sheet, with room for axes and a colour bar
  double height = 0.0;
  int x_ticks = 0;
  int y_ticks = 0;

  CanvasBox color_bar() const { return {box.right + 30.0, box.top + 24.0, box.right + 52.0, box.bottom}; }
  double x_at(double canvas_x) const;  ///< map x of a point of the canvas
  double y_at(double canvas_y) const;
};

/// `top`: height of the part above the plan.
PlanSheet plan_sheet(const PlanExtent& extent, double top);

}  // namespace lodestone
