#include "tools/plotting/plan_parts.h"

#include <algorithm>

#include "tools/plotting/color_bar.h"

namespace lodestone::figures {

namespace {

constexpr Color kNoValue{226, 231, 237};

}  // namespace

PlanExtent extent_of(const PlanRaster& raster, const std::vector<Vector3>& track) {
  if (raster.values.cols > 1 && raster.values.rows > 1)
    return {raster.x_m, raster.x_high(), raster.y_m, raster.y_high()};
  PlanExtent extent;
  for (const Vector3& point : track) {
    if (point.allFinite()) extent.include(point.x(), point.y());
  }
  if (!(extent.x_high >= extent.x_low)) return {0.0, 1.0, 0.0, 1.0};
  extent.widen(1.0, 0.0);
  return extent;
}

void draw_raster(Canvas& canvas, const CanvasBox& box, const PlanExtent& extent, const PlanRaster& raster,
                 const Scale& scale, ColorRamp ramp) {
  canvas.fill(box, kNoValue);
  shade_raster(canvas, box, extent, raster, scale, ramp, RasterInterpolation::bilinear);
}

void draw_track(Canvas& canvas, const Axes& axes, const std::vector<Vector3>& track, Color color, double width) {
  std::vector<CanvasPoint> points;
  for (const Vector3& point : track) {
    if (point.allFinite()) points.push_back(axes.at(point.x(), point.y()));
  }
  canvas.clip(axes.box());
  canvas.polyline(points, ink::white, width + 1.6);
  canvas.polyline(points, color, width);
  canvas.unclip();
}

void draw_upright_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp,
                            const std::string& title) {
  canvas.shade(
      box, [&](CanvasPoint point) { return (box.bottom - point.y) / box.height(); }, ramp);
  canvas.frame(box, ink::frame, 1.0);
  double widest = 0.0;
  for (const double tick : scale.ticks(tick_count(box.height(), 30.0))) {
    const double y = box.bottom - scale.share(tick) * box.height();
    canvas.line({box.right, y}, {box.right + 4.0, y}, ink::frame, 1.0);
    canvas.text({box.right + 7.0, y}, tick_text(tick), ink::letter, ink::text, Anchor::begin, Anchor::middle);
    widest = std::max(widest, canvas.text_width(tick_text(tick), ink::letter));
  }
  canvas.vertical_text({box.right + 18.0 + widest, 0.5 * (box.top + box.bottom)}, title, ink::letter, ink::text);
}

int tick_count(double length, double least_spacing) {
  return std::max(2, static_cast<int>(length / least_spacing));
}

}  // namespace lodestone::figures
