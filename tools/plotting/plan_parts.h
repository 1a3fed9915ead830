#pragma once

#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/plan_raster.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone::figures {

/// What the raster covers; where it is empty, what the track covers.
PlanStretch extent_of(const PlanRaster& raster, const std::vector<Vector3>& track);

/// Values in colour; a pale blue grey where there are none.
void draw_raster(Canvas& canvas, const CanvasBox& box, const PlanStretch& extent, const PlanRaster& raster,
                 const Scale& scale, ColorRamp ramp);

/// A line through the positions' x and y, white round it.
void draw_track(Canvas& canvas, const Axes& axes, const std::vector<Vector3>& track, Color color, double width);

/// The scale beside a plan: colours, numbers at the right, and its title upright beside them.
void draw_upright_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp,
                            const std::string& title);

/// How many ticks an axis of so many logical pixels takes without its numbers touching.
int tick_count(double length, double least_spacing);

}  // namespace lodestone::figures
