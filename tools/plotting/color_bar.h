#pragma once

#include <string>

#include "tools/plotting/axes.h"

namespace lodestone {

/// The colours of `ramp` from the scale's low end, at the bottom, to its high end, with ticks at the right and `title` above.
void draw_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp, const std::string& title);

}  // namespace lodestone
