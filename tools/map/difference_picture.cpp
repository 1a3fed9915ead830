#include "tools/map/difference_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tools/plotting/axes.h"
#include "tools/plotting/color_bar.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone {
namespace {

/// From 0 to the 99.5 % quantile of the nodes, so that single strong nodes do not dominate the scale.
Scale change_range(const PlanRaster& change) {
  const double high = quantile(change.values, 0.995);
  return std::isfinite(high) ? Scale{0.0, std::max(high, 0.1)} : Scale{0.0, 1.0};
}

/// The extent of the compared nodes.
PlanExtent drawn_extent(const PlanRaster& change) {
  PlanExtent extent;
  const cv::Rect compared = cv::boundingRect(~without_value(change.values));
  if (!compared.empty()) {
    const auto node = [&](cv::Point at) {
      extent.include(change.x_m + change.resolution_m * at.x, change.y_m + change.resolution_m * at.y);
    };
    node(compared.tl());
    node(compared.br() - cv::Point(1, 1));
  }
  extent.widen(0.5, 0.02);
  return extent;
}

constexpr double kRing = 11.0;  ///< radius of the ring around the largest change, logical pixels

/// A white and black ring, visible on every colour.
void draw_ring(Canvas& canvas, CanvasPoint center, double radius) {
  constexpr int corners = 40;
  std::vector<CanvasPoint> ring;
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2.0 * M_PI * i / corners;
    ring.push_back({center.x + radius * std::cos(angle), center.y + radius * std::sin(angle)});
  }
  canvas.polyline(ring, ink::white, 5.0);
  canvas.polyline(ring, ink::truth, 2.0);
}

/// Text on a white background, within `box`.
void draw_note(Canvas& canvas, const CanvasBox& box, CanvasPoint at, const std::string& text, double size) {
  const double width = canvas.text_width(text, size) + 8.0;
  const double left = std::clamp(at.x, box.left, std::max(box.left, box.right - width));
  const double top = std::clamp(at.y - 0.5 * size - 5.0, box.top, box.bottom - size - 10.0);
  canvas.fill({left, top, left + width, top + size + 10.0}, ink::white, 0.8);
  canvas.text({left + 4.0, top + 0.5 * size + 5.0}, text, size, ink::text, Anchor::begin, Anchor::middle);
}

/// The number of a place beside it, with a line to its largest change at `at`. `radius`: of a disk of the same area.
void draw_number(Canvas& canvas, const CanvasBox& box, CanvasPoint at, double radius, std::size_t number) {
  constexpr double kSize = 12.0;
  const double distance = std::clamp(radius, 8.0, 40.0) + 6.0;
  const double width = canvas.text_width(std::to_string(number), kSize) + 8.0;
  const bool right = at.x + distance + width < box.right;
  const double left = right ? at.x + distance : at.x - distance - width;
  canvas.line(at, {right ? left : left + width, at.y}, ink::truth, 1.0);
  draw_note(canvas, box, {left, at.y}, std::to_string(number), kSize);
}

}  // namespace

void draw_difference_picture(const std::filesystem::path& path, const MagneticDifference& difference,
                             const std::vector<ChangedPlace>& places, const std::string& title) {
  const PlanRaster change = change_raster(difference);
  const PlanSheet sheet = plan_sheet(drawn_extent(change), 76.0);
  const CanvasBox& box = sheet.box;
  Canvas canvas(sheet.width, sheet.height);
  const double room = sheet.width - box.left - 10.0;
  const double title_size = std::min(ink::title, ink::title * room / canvas.text_width(title, ink::title));
  canvas.text({box.left, 14.0}, title, title_size, ink::text, Anchor::begin, Anchor::begin);
  canvas.text({box.left, 42.0},
              fmt::format("{:.1f} m² compared; mean {:.2f}, 95 % below {:.2f}, largest {:.2f} µT",
                          difference.compared_m2, difference.mean_ut, difference.high_ut, difference.largest_ut),
              ink::letter, ink::text, Anchor::begin, Anchor::begin);

  const Scale scale = change_range(change);
  const PlanExtent& extent = sheet.extent;
  Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
  canvas.fill(box, {240, 240, 240});
  shade_raster(canvas, box, extent, change, scale, ColorRamp::heat, RasterInterpolation::nearest);
  draw_color_bar(canvas, sheet.color_bar(), scale, ColorRamp::heat, "|ΔB| µT",
                 difference.largest_ut > 1.001 * scale.high);
  // The ring's text has the number of its place, which would be below this text otherwise.
  const auto on_canvas = [&axes](const Vector3& at) { return axes.at(at.x(), at.y()); };
  const CanvasPoint largest = on_canvas(difference.largest_at);
  const auto in_ring = [&](CanvasPoint at) { return std::hypot(at.x - largest.x, at.y - largest.y) < kRing; };
  const bool ring_is_first = !places.empty() && in_ring(on_canvas(places.front().largest_at));
  for (std::size_t i = ring_is_first ? 1 : 0; i < std::min<std::size_t>(places.size(), 10); ++i) {
    const double radius = std::sqrt(places[i].area_m2 / M_PI) / extent.width() * box.width();
    draw_number(canvas, box, on_canvas(places[i].largest_at), radius, i + 1);
  }
  if (difference.nodes > 0) {
    draw_ring(canvas, largest, kRing);
    draw_note(canvas, box, {largest.x + 18.0, largest.y},
              fmt::format("{}{:.1f} µT at {:.2f}, {:.2f} m", ring_is_first ? "1: " : "", difference.largest_ut,
                          difference.largest_at.x(), difference.largest_at.y()),
              ink::letter);
  }
  axes.labels("x, m", "y, m", sheet.x_ticks, sheet.y_ticks);
  canvas.save(path);
}

}  // namespace lodestone
