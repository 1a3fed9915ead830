#include "tools/pictures/stale_map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/pictures/axes.h"

namespace lodestone {

namespace {

constexpr double kLongestStep_m = 1.0;  // between points of one line: beyond it readings are missing
constexpr Color kStale{20, 20, 20};

/// Blue, yellow, red (after ColorBrewer's RdYlBu): small differences recede, large ones stand out, on grey.
Color difference_color(double share) {
  static constexpr std::array<std::array<double, 3>, 5> kSteps{
      {{69, 117, 180}, {145, 191, 219}, {254, 224, 144}, {244, 109, 67}, {165, 0, 38}}};
  const double place = std::clamp(share, 0.0, 1.0) * (kSteps.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(place), kSteps.size() - 2);
  const double part = place - static_cast<double>(low);
  std::array<int, 3> mixed{};
  for (std::size_t i = 0; i < 3; ++i) {
    mixed[i] = static_cast<int>(std::lround(kSteps[low][i] * (1.0 - part) + kSteps[low + 1][i] * part));
  }
  return {mixed[0], mixed[1], mixed[2]};
}

struct Extent {
  double x_low = std::numeric_limits<double>::infinity();
  double x_high = -std::numeric_limits<double>::infinity();
  double y_low = std::numeric_limits<double>::infinity();
  double y_high = -std::numeric_limits<double>::infinity();
};

/// The drive with some surroundings: what of the map was not driven through has nothing to say here.
Extent extent_of(const std::vector<DifferencePoint>& drive) {
  Extent extent;
  for (const DifferencePoint& point : drive) {
    extent.x_low = std::min(extent.x_low, point.position.x());
    extent.x_high = std::max(extent.x_high, point.position.x());
    extent.y_low = std::min(extent.y_low, point.position.y());
    extent.y_high = std::max(extent.y_high, point.position.y());
  }
  if (drive.empty()) extent = {-1.0, 1.0, -1.0, 1.0};
  const double margin = std::max(1.5, 0.03 * std::max(extent.x_high - extent.x_low, extent.y_high - extent.y_low));
  return {extent.x_low - margin, extent.x_high + margin, extent.y_low - margin, extent.y_high + margin};
}

/// Up to what all but one in two hundred points stay below; logarithmic where one spot would make all else look alike.
Scale difference_scale(const std::vector<DifferencePoint>& drive) {
  std::vector<double> sizes;
  for (const DifferencePoint& point : drive) sizes.push_back(point.size_ut);
  std::sort(sizes.begin(), sizes.end());
  if (sizes.empty()) return {0.0, 1.0};
  const double high = std::max(1.0, sizes[static_cast<std::size_t>(0.995 * (static_cast<double>(sizes.size()) - 1.0))]);
  const double usual = std::max(0.1, sizes[sizes.size() / 2]);
  if (high > 15.0 * usual) return {usual, high, true};
  return {0.0, high};
}

void draw_pale_map(Canvas& canvas, const CanvasBox& box, const Extent& extent, const MagneticMap& map, double height) {
  const auto strength = [&](CanvasPoint point) {
    const double x = extent.x_low + (point.x - box.left) / box.width() * (extent.x_high - extent.x_low);
    const double y = extent.y_high - (point.y - box.top) / box.height() * (extent.y_high - extent.y_low);
    const auto value = map.query({x, y, height}, FieldInterpolation::bilinear);
    return value ? value->field_ut.norm() : std::nan("");
  };
  std::vector<double> seen;  // sets the greys; a bolt must not take the whole scale
  for (double y = box.top; y < box.bottom; y += 4.0) {
    for (double x = box.left; x < box.right; x += 4.0) {
      const double value = strength({x, y});
      if (std::isfinite(value)) seen.push_back(value);
    }
  }
  if (seen.empty()) return;
  std::sort(seen.begin(), seen.end());
  const double low = seen[seen.size() / 50];
  const double high = std::max(low + 0.1, seen[seen.size() - 1 - seen.size() / 50]);
  canvas.shade(box, [&](CanvasPoint point, Color& color) {
    const double value = strength(point);
    if (!std::isfinite(value)) return false;
    const int grey = static_cast<int>(std::lround(232.0 - 58.0 * std::clamp((value - low) / (high - low), 0.0, 1.0)));
    color = {grey, grey, grey};
    return true;
  });
}

void draw_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale) {
  canvas.shade(box, [&](CanvasPoint point, Color& color) {
    color = difference_color((box.bottom - point.y) / box.height());
    return true;
  });
  canvas.frame(box, ink::frame, 1.0);
  for (const double tick : scale.ticks(std::max(2, static_cast<int>(box.height() / 42.0)))) {
    const double y = box.bottom - scale.share(tick) * box.height();
    canvas.line({box.right, y}, {box.right + 5.0, y}, ink::frame, 1.0);
    canvas.text({box.right + 9.0, y}, tick_text(tick), ink::letter, ink::text, Anchor::begin, Anchor::middle);
  }
  canvas.text({0.5 * (box.left + box.right), box.top - 10.0}, "|ΔB| µT", ink::letter, ink::text, Anchor::middle, Anchor::end);
}

void draw_drive(Canvas& canvas, const Axes& axes, const std::vector<DifferencePoint>& drive, const Scale& scale, double width) {
  for (std::size_t i = 1; i < drive.size(); ++i) {
    const Vector3& from = drive[i - 1].position;
    const Vector3& to = drive[i].position;
    if ((to - from).norm() > kLongestStep_m) continue;
    canvas.line(axes.at(from.x(), from.y()), axes.at(to.x(), to.y()),
                difference_color(scale.share(0.5 * (drive[i - 1].size_ut + drive[i].size_ut))), width);
  }
}

/// The outline of a place: the sides of its cells that no other of its cells shares.
void draw_outlines(Canvas& canvas, const Axes& axes, const StaleMap& stale) {
  const double side = stale.options.cell_m;
  const auto place_at = [&](CellKey key) {
    const auto found = std::lower_bound(stale.cells.begin(), stale.cells.end(), key,
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

/// Numbers of the places, the worst on top; places whose number would lie on another's go without.
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

}  // namespace

void draw_stale_map_picture(const std::filesystem::path& path, const MagneticMap& map,
                            const std::vector<DifferencePoint>& drive, const StaleMap& stale) {
  constexpr double kPlotWidth = 1200.0;
  constexpr double kMaxHeight = 1000.0;
  constexpr double kMinHeight = 260.0;
  Extent extent = extent_of(drive);
  const double wide = extent.x_high - extent.x_low;
  const double high = extent.y_high - extent.y_low;
  const double pixels_a_metre = std::min(kPlotWidth / wide, kMaxHeight / high);
  const double plot_width = std::max(500.0, wide * pixels_a_metre);
  const double plot_height = std::max(kMinHeight, high * pixels_a_metre);
  const double spare_x = 0.5 * (plot_width / pixels_a_metre - wide);
  const double spare_y = 0.5 * (plot_height / pixels_a_metre - high);
  extent = {extent.x_low - spare_x, extent.x_high + spare_x, extent.y_low - spare_y, extent.y_high + spare_y};

  const CanvasBox box{100.0, 76.0, 100.0 + plot_width, 76.0 + plot_height};
  Canvas canvas(box.right + 120.0, box.bottom + 70.0);
  canvas.text({box.left, 14.0}, "Measured field less the map's, along the drive", ink::title, ink::text, Anchor::begin,
              Anchor::begin);
  canvas.text({box.left, 44.0},
              fmt::format("{} stale place{} in {} cells of {:g} m driven through; probability of false alarm {:g} a cell",
                          stale.places.size(), stale.places.size() == 1 ? "" : "s", stale.cells.size(), stale.options.cell_m,
                          stale.options.false_alarm_probability),
              ink::letter, ink::text, Anchor::begin, Anchor::begin);

  Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
  const int x_ticks = static_cast<int>(plot_width / 110.0);
  const int y_ticks = std::max(2, static_cast<int>(plot_height / 80.0));
  double height = 0.0;
  for (const DifferencePoint& point : drive) height += point.position.z() / static_cast<double>(drive.size());
  draw_pale_map(canvas, box, extent, map, height);
  const Scale scale = difference_scale(drive);
  draw_color_bar(canvas, {box.right + 30.0, box.top + 24.0, box.right + 52.0, box.bottom}, scale);
  canvas.clip(box);
  draw_drive(canvas, axes, drive, scale, 6.0);
  draw_outlines(canvas, axes, stale);
  draw_numbers(canvas, axes, stale);
  canvas.unclip();
  axes.labels("x, m", "y, m", x_ticks, y_ticks);
  canvas.save(path);
}

}  // namespace lodestone
