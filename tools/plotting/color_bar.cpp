#include "tools/plotting/color_bar.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/plotting/drawing.h"

namespace lodestone {

void draw_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp, const std::string& title,
                    bool cut) {
  canvas.shade(
      box, [&](CanvasPoint point) { return (box.bottom - point.y) / box.height(); }, ramp);
  canvas.frame(box, ink::frame, 1.0);
  for (const double tick : scale.ticks(std::max(2, static_cast<int>(box.height() / 42.0)))) {
    const double y = box.bottom - scale.share(tick) * box.height();
    if (cut && y < box.top + 1.3 * ink::letter) continue;
    canvas.line({box.right, y}, {box.right + 5.0, y}, ink::frame, 1.0);
    canvas.text({box.right + 9.0, y}, tick_text(tick), ink::letter, ink::text, Anchor::begin, Anchor::middle);
  }
  if (cut) {
    canvas.line({box.right, box.top}, {box.right + 5.0, box.top}, ink::frame, 1.0);
    const std::string label = fmt::format("≥ {:.3g}", scale.high);
    canvas.text({box.right + 9.0, box.top}, label, ink::letter, ink::text, Anchor::begin, Anchor::middle);
  }
  canvas.text({0.5 * (box.left + box.right), box.top - 10.0}, title, ink::letter, ink::text, Anchor::middle,
              Anchor::end);
}

void shade_raster(Canvas& canvas, const CanvasBox& box, const PlanExtent& extent, const PlanRaster& raster,
                  const Scale& scale, ColorRamp ramp, RasterInterpolation interpolation) {
  const cv::Rect pixels = canvas.pixels_of(box);
  const double x_step = extent.width() / box.width() / kPixelsPerLogical;
  const double y_step = extent.height() / box.height() / kPixelsPerLogical;
  PlanPoints points;
  points.x_m = extent.x_low + (pixels.x + 0.5 - box.left * kPixelsPerLogical) * x_step;
  points.y_m = extent.y_high - (pixels.y + 0.5 - box.top * kPixelsPerLogical) * y_step;
  points.x_step_m = x_step;
  points.y_step_m = -y_step;
  points.count = pixels.size();
  cv::Mat1f shares = values_at(raster, points, interpolation);
  for (float& value : shares) value = static_cast<float>(scale.share(value));
  canvas.shade(box, shares, ramp);
}

}  // namespace lodestone
