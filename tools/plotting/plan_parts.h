#pragma once

#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/plan_raster.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone::figures {

/// The extent of the raster, or of the track if the raster is empty.
PlanExtent extent_of(const PlanRaster& raster, const std::vector<Vector3>& track);

/// Values in colour; pale blue grey where there are none.
void draw_raster(Canvas& canvas, const CanvasBox& box, const PlanExtent& extent, const PlanRaster& raster,
                 const Scale& scale, ColorRamp ramp);

/// A line through the positions' x and y, with a white outline.
void draw_track(Canvas& canvas, const Axes& axes, const std::vector<Vector3>& track, Color color, double width);

/// Colour bar next to a plan: colours, numbers at the right, vertical title.
void draw_upright_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp,
                            const std::string& title);

/// Number of ticks for an axis of `length` logical pixels, so that numbers do not overlap.
int tick_count(double length, double least_spacing);

}  // namespace lodestone::figures
