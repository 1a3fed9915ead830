#pragma once

#include <string>

#include "tools/plotting/axes.h"
#include "tools/plotting/plan_raster.h"

namespace lodestone {

/// The colours of `ramp` from the scale's low end at the bottom to its high end, with ticks at the right and `title`
/// above. `cut`: some values are beyond the high end, which gets the sign ≥.
void draw_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp, const std::string& title,
                    bool cut = false);

/// Colours the raster's values on `box`, which shows `extent`. Places without value are transparent.
void shade_raster(Canvas& canvas, const CanvasBox& box, const PlanExtent& extent, const PlanRaster& raster,
                  const Scale& scale, ColorRamp ramp, RasterInterpolation interpolation);

}  // namespace lodestone
