#include "tools/plotting/plan_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/middle_value.h"
#include "tools/plotting/page.h"
#include "tools/plotting/plan_parts.h"

namespace lodestone::figures {

namespace {

constexpr double kLeft = 66.0;
constexpr double kBarSpace = 92.0;  // width of a colour bar with its numbers and title
constexpr double kBarWidth = 16.0;
constexpr double kTitle = 28.0;  // height above a panel
constexpr double kLeastHeight = 84.0;
constexpr double kTallest = 900.0;  // two thirds of a page

/// The fewest columns with a height below kTallest. `a_row`: height of a row in addition to its panel.
struct Layout {
  std::size_t columns = 1;
  double width = 0.0;
  double height = 0.0;
};

Layout layout_of(std::size_t panels, double ratio, double gap, double a_row) {
  Layout layout;
  const double available = kPageWidth - kLeft - kBarSpace;
  for (layout.columns = 1; layout.columns <= std::max<std::size_t>(1, panels); ++layout.columns) {
    const auto columns = static_cast<double>(layout.columns);
    layout.width = (available - gap * (columns - 1.0)) / columns;
    layout.height = std::max(layout.width / ratio, kLeastHeight);
    const auto rows = static_cast<double>((panels + layout.columns - 1) / layout.columns);
    if (rows * (layout.height + a_row) <= kTallest || layout.columns == panels) break;
  }
  return layout;
}

/// From 0 to a quantile, so that single strong points do not dominate the scale.
Scale difference_scale(double high) {
  return {0.0, high > 0.5 ? high : 0.5};
}

}  // namespace

void draw_map_differences(const std::filesystem::path& path, const std::vector<DifferencePanel>& panels) {
  double ratio = 100.0;
  double high = 0.0;
  for (const DifferencePanel& panel : panels) {
    const PlanExtent extent = extent_of(panel.difference_ut, panel.track);
    ratio = std::min(ratio, extent.width() / extent.height());
    const double strong = quantile(panel.difference_ut.values, 0.998);
    if (std::isfinite(strong)) high = std::max(high, strong);
  }
  constexpr double kGap = 20.0;
  constexpr double kRow = kTitle + 8.0;
  const Layout layout = layout_of(std::max<std::size_t>(1, panels.size()), ratio, kGap, kRow);
  const std::size_t rows = (std::max<std::size_t>(1, panels.size()) + layout.columns - 1) / layout.columns;
  const double bottom = static_cast<double>(rows) * (layout.height + kRow) - 8.0;
  const Scale scale = difference_scale(high);
  Canvas canvas(kPageWidth, bottom + 60.0);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const DifferencePanel& panel = panels[i];
    const std::size_t column = i % layout.columns;
    const double left = kLeft + static_cast<double>(column) * (layout.width + kGap);
    const double top = kTitle + static_cast<double>(i / layout.columns) * (layout.height + kRow);
    const CanvasBox box{left, top, left + layout.width, top + layout.height};
    const PlanExtent extent = extent_of(panel.difference_ut, panel.track).filling(layout.width / layout.height);
    draw_raster(canvas, box, extent, panel.difference_ut, scale, ColorRamp::difference);
    Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
    if (!panel.track.empty()) draw_track(canvas, axes, panel.track, ink::truth, 1.6);
    const bool lowest = i + layout.columns >= panels.size();
    axes.ticks(lowest, column == 0, tick_count(layout.width, 80.0), tick_count(layout.height, 34.0));
    canvas.text({box.left, box.top - 8.0}, panel.title, ink::letter, ink::text, Anchor::begin, Anchor::end);
    const double largest = quantile(panel.difference_ut.values, 1.0);
    if (std::isfinite(largest)) {
      canvas.text({box.right, box.top - 8.0}, fmt::format("largest {:.1f} µT", largest), ink::letter, ink::text,
                  Anchor::end, Anchor::end);
    }
    const double middle = 0.5 * (box.top + box.bottom);
    if (lowest) {
      canvas.text({0.5 * (box.left + box.right), box.bottom + 34.0}, "x, m", ink::letter, ink::text, Anchor::middle,
                  Anchor::begin);
    }
    if (column == 0) canvas.vertical_text({12.0, middle}, "y, m", ink::letter, ink::text);
  }
  const double right = kPageWidth - kBarSpace + 16.0;
  draw_upright_color_bar(canvas, {right, kTitle, right + kBarWidth, bottom}, scale, ColorRamp::difference, "|ΔB|, µT");
  canvas.save(path);
}

void draw_residuals_over_difference(const std::filesystem::path& path, const PlanRaster& difference_ut,
                                    const std::vector<ResidualPanel>& panels) {
  const std::size_t count = std::max<std::size_t>(1, panels.size());
  const PlanExtent whole =
      extent_of(difference_ut, panels.empty() ? std::vector<Vector3>{} : panels.front().track.position);
  constexpr double kRow = kTitle + 10.0;
  constexpr double kTwoBars = 2.0 * kBarSpace;
  const double width = kPageWidth - kLeft - kTwoBars;
  const double fit = (kTallest - static_cast<double>(count) * kRow) / static_cast<double>(count);
  const double height = std::clamp(width * whole.height() / whole.width(), 110.0, std::max(110.0, fit));
  const PlanExtent extent = whole.filling(width / height);
  std::vector<double> residuals;
  for (const ResidualPanel& panel : panels) {
    for (const double value : panel.track.difference_ut) {
      if (std::isfinite(value)) residuals.push_back(value);
    }
  }
  const Scale residual = difference_scale(residuals.empty() ? 0.0 : value_at_share(residuals, 0.995));
  const Scale background = difference_scale(quantile(difference_ut.values, 0.998));

  const double bottom = static_cast<double>(count) * (height + kRow) - 10.0;
  Canvas canvas(kPageWidth, bottom + 60.0);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const double top = kTitle + static_cast<double>(i) * (height + kRow);
    const CanvasBox box{kLeft, top, kLeft + width, top + height};
    draw_raster(canvas, box, extent, difference_ut, background, ColorRamp::grey);
    Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
    const ResidualTrack& track = panels[i].track;
    draw_track(canvas, axes, track.position, ink::white, 6.0);
    canvas.clip(box);
    for (std::size_t k = 1; k < std::min(track.position.size(), track.difference_ut.size()); ++k) {
      if (!std::isfinite(track.difference_ut[k]) || !track.position[k].allFinite() ||
          !track.position[k - 1].allFinite())
        continue;
      canvas.line(axes.at(track.position[k - 1].x(), track.position[k - 1].y()),
                  axes.at(track.position[k].x(), track.position[k].y()),
                  color_of(ColorRamp::vivid, residual.share(track.difference_ut[k])), 5.0);
    }
    canvas.unclip();
    axes.ticks(i + 1 == panels.size(), true, tick_count(width, 80.0), tick_count(height, 34.0));
    canvas.text({box.left, box.top - 8.0}, panels[i].title, ink::letter, ink::text, Anchor::begin, Anchor::end);
    canvas.vertical_text({12.0, 0.5 * (box.top + box.bottom)}, "y, m", ink::letter, ink::text);
  }
  canvas.text({kLeft + 0.5 * width, bottom + 34.0}, "x, m", ink::letter, ink::text, Anchor::middle, Anchor::begin);
  const double right = kLeft + width + 16.0;
  draw_upright_color_bar(canvas, {right, kTitle, right + kBarWidth, bottom}, residual, ColorRamp::vivid,
                         "|measured − map|, µT");
  draw_upright_color_bar(canvas, {right + kBarSpace, kTitle, right + kBarSpace + kBarWidth, bottom}, background,
                         ColorRamp::grey, "|ΔB| of the maps, µT");
  canvas.save(path);
}

}  // namespace lodestone::figures
