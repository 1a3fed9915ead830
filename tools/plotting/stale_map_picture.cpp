#include "tools/plotting/stale_map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/middle_value.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/color_bar.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone {

namespace {

constexpr double kLongestStep_m = 1.0;  // longest segment of a line; longer ones are gaps of readings
constexpr Color kStale{20, 20, 20};

/// The drive with some surroundings. The rest of the map is of no interest.
PlanExtent drawn_extent(const std::vector<DifferencePoint>& drive) {
  PlanExtent extent;
  for (const DifferencePoint& point : drive) extent.include(point.position.x(), point.position.y());
  extent.widen(1.5, 0.03);
  return extent;
}

/// Up to the 99.5 % quantile; logarithmic if single spots would dominate a linear scale.
Scale difference_scale(const std::vector<DifferencePoint>& drive) {
  std::vector<double> sizes;
  for (const DifferencePoint& point : drive) sizes.push_back(point.size_ut);
  if (sizes.empty()) return {0.0, 1.0};
  const double high = std::max(1.0, value_at_share(sizes, 0.995));
  const double usual = std::max(0.1, middle_value(sizes));
  if (high > 15.0 * usual) return {usual, high, true};
  return {0.0, high};
}

void draw_pale_map(Canvas& canvas, const PlanSheet& sheet, const MagneticMap& map, double height) {
  const CanvasBox& box = sheet.box;
  constexpr std::size_t kSamples = 100'000;
  const PlanRaster seen = strength_raster(map, height, sheet.extent, kSamples);
  const double low = quantile(seen.values, 0.02);  // limits the greys, so that single strong nodes do not dominate
  if (!std::isfinite(low)) return;
  const Scale scale{low, std::max(low + 0.1, quantile(seen.values, 0.98))};
  canvas.shade(
      box,
      [&](CanvasPoint point) {
        return scale.share(strength_at(map, {sheet.x_at(point.x), sheet.y_at(point.y), height}));
      },
      ColorRamp::pale_grey);
}

void draw_drive(Canvas& canvas, const Axes& axes, const std::vector<DifferencePoint>& drive, const Scale& scale,
                double width) {
  for (std::size_t i = 1; i < drive.size(); ++i) {
    const Vector3& from = drive[i - 1].position;
    const Vector3& to = drive[i].position;
    if ((to - from).norm() > kLongestStep_m) continue;
    canvas.line(axes.at(from.x(), from.y()), axes.at(to.x(), to.y()),
                color_of(ColorRamp::vivid, scale.share(0.5 * (drive[i - 1].size_ut + drive[i].size_ut))), width);
  }
}

/// The outline of a place: sides of its cells without a neighbour of the same place.
void draw_outlines(Canvas& canvas, const Axes& axes, const StaleMap& stale) {
  const double side = stale.options.cell_m;
  const auto place_at = [&](CellKey key) {
    const auto found =
        std::lower_bound(stale.cells.begin(), stale.cells.end(), key,
                         [](const FieldCellTest& cell, const CellKey& wanted) { return cell.key < wanted; });
    return found != stale.cells.end() && found->key == key ? found->place : 0;
  };
  for (const FieldCellTest& cell : stale.cells) {
    if (cell.place == 0) continue;
    const double x = side * cell.key.first;
    const double y = side * cell.key.second;
    const auto edge = [&](CellKey neighbour, double x0, double y0, double x1, double y1) {
      if (place_at(neighbour) != cell.place) canvas.line(axes.at(x0, y0), axes.at(x1, y1), kStale, 1.6);
    };
    edge({cell.key.first - 1, cell.key.second}, x, y, x, y + side);
    edge({cell.key.first + 1, cell.key.second}, x + side, y, x + side, y + side);
    edge({cell.key.first, cell.key.second - 1}, x, y, x + side, y);
    edge({cell.key.first, cell.key.second + 1}, x, y + side, x + side, y + side);
  }
}

/// Numbers of the places, the worst on top. Overlapping numbers are omitted.
void draw_numbers(Canvas& canvas, const Axes& axes, const StaleMap& stale) {
  constexpr double kRadius = 11.0;
  std::vector<CanvasPoint> drawn;
  for (const StalePlace& place : stale.places) {
    double top = place.center.y();
    for (const FieldCellTest& cell : stale.cells) {
      if (cell.place == place.number) top = std::max(top, stale.options.cell_m * (cell.key.second + 1));
    }
    CanvasPoint at = axes.at(place.center.x(), top);
    at.y = std::clamp(at.y - kRadius - 2.0, axes.box().top + kRadius, axes.box().bottom - kRadius);
    at.x = std::clamp(at.x, axes.box().left + kRadius, axes.box().right - kRadius);
    const bool covered = std::any_of(drawn.begin(), drawn.end(), [&](const CanvasPoint& other) {
      return std::hypot(other.x - at.x, other.y - at.y) < 2.0 * kRadius;
    });
    if (covered) continue;
    drawn.push_back(at);
    canvas.disk(at, kRadius, kStale);
    canvas.disk(at, kRadius - 1.5, ink::white);
    canvas.text(at, std::to_string(place.number), 12.0, ink::text, Anchor::middle, Anchor::middle);
  }
}

/// The verdict of the terminal, in lines.
std::vector<std::string> subtitle_of(const StaleMap& stale) {
  if (stale.map_is_hardly_the_cause()) {
    return {fmt::format("The field differs from the map in {} of {} visited cells of {:g} m:", stale.stale_cells(),
                        stale.cells.size(), stale.options.cell_m),
            "rather the trajectory, the calibration or the choice of the map is wrong"};
  }
  return {fmt::format("{} stale place{} in {} visited cells of {:g} m; probability of false alarm {:g} per cell",
                      stale.places.size(), stale.places.size() == 1 ? "" : "s", stale.cells.size(),
                      stale.options.cell_m, stale.options.false_alarm_probability)};
}

}  // namespace

void draw_stale_map_picture(const std::filesystem::path& path, const std::string& estimator, const MagneticMap& map,
                            const std::vector<DifferencePoint>& drive, const StaleMap& stale) {
  constexpr double kSubtitleTop = 44.0;
  constexpr double kLine = 20.0;
  const std::vector<std::string> subtitle = subtitle_of(stale);
  const PlanSheet sheet = plan_sheet(drawn_extent(drive), 56.0 + kLine * static_cast<double>(subtitle.size()));
  const CanvasBox& box = sheet.box;
  Canvas canvas(sheet.width, sheet.height);
  canvas.text({box.left, 14.0}, "Measured minus mapped field along the drive of " + estimator, ink::title, ink::text,
              Anchor::begin, Anchor::begin);
  for (std::size_t i = 0; i < subtitle.size(); ++i) {
    canvas.text({box.left, kSubtitleTop + kLine * static_cast<double>(i)}, subtitle[i], ink::letter, ink::text,
                Anchor::begin, Anchor::begin);
  }

  const PlanExtent& extent = sheet.extent;
  Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
  double height = 0.0;
  for (const DifferencePoint& point : drive) height += point.position.z() / static_cast<double>(drive.size());
  draw_pale_map(canvas, sheet, map, height);
  const Scale scale = difference_scale(drive);
  const bool cut =
      std::any_of(drive.begin(), drive.end(), [&](const DifferencePoint& point) { return point.size_ut > scale.high; });
  draw_color_bar(canvas, sheet.color_bar(), scale, ColorRamp::vivid, "|ΔB| µT", cut);
  canvas.clip(box);
  draw_drive(canvas, axes, drive, scale, 6.0);
  draw_outlines(canvas, axes, stale);
  draw_numbers(canvas, axes, stale);
  canvas.unclip();
  axes.labels("x, m", "y, m", sheet.x_ticks, sheet.y_ticks);
  canvas.save(path);
}

}  // namespace lodestone
