#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/pictures/axes.h"
#include "tools/pictures/color_bar.h"
#include "tools/pictures/pictures.h"

namespace lodestone {

namespace {

struct Extent {
  double x_low = std::numeric_limits<double>::infinity();
  double x_high = -std::numeric_limits<double>::infinity();
  double y_low = std::numeric_limits<double>::infinity();
  double y_high = -std::numeric_limits<double>::infinity();

  void include(double x, double y) {
    x_low = std::min(x_low, x);
    x_high = std::max(x_high, x);
    y_low = std::min(y_low, y);
    y_high = std::max(y_high, y);
  }

  void widen(double margin) {
    x_low -= margin;
    x_high += margin;
    y_low -= margin;
    y_high += margin;
  }
};

/// What the truth and the map cover. A lost estimate may lie far off: it is cut at the edge, not shown whole.
Extent extent_of(const MagneticMap* map, const Trajectory& truth, const std::vector<PictureSeries>& series) {
  Extent extent;
  for (const StampedPose& pose : truth) extent.include(pose.pose.position.x(), pose.pose.position.y());
  if (map != nullptr) {
    const FieldGrid& grid = map->grid();
    extent.include(grid.origin.x(), grid.origin.y());
    extent.include(grid.origin.x() + grid.resolution_m * (grid.columns - 1),
                   grid.origin.y() + grid.resolution_m * (grid.rows - 1));
  }
  if (truth.empty() && map == nullptr) {
    for (const PictureSeries& one : series) {
      for (const StampedPose& pose : one.trajectory) extent.include(pose.pose.position.x(), pose.pose.position.y());
    }
  }
  if (!(extent.x_high >= extent.x_low)) extent = {-1.0, 1.0, -1.0, 1.0};
  extent.widen(std::max(0.5, 0.02 * std::max(extent.x_high - extent.x_low, extent.y_high - extent.y_low)));
  return extent;
}

double mean_height(const Trajectory& truth, const std::vector<PictureSeries>& series) {
  const Trajectory* trajectory = &truth;
  if (truth.empty() && !series.empty()) trajectory = &series.front().trajectory;
  double sum = 0.0;
  for (const StampedPose& pose : *trajectory) sum += pose.pose.position.z();
  return trajectory->empty() ? 0.0 : sum / static_cast<double>(trajectory->size());
}

/// The strength between whose 1 % and 99 % quantiles the colours run: a single bolt must not take the whole scale.
Scale strength_range(const MagneticMap& map) {
  std::vector<double> strengths;
  map.for_each_node([&](const Eigen::Vector4f& node) {
    if (node(3) <= map.max_sigma_ut()) strengths.push_back(node.head<3>().norm());
  });
  if (strengths.empty()) return {0.0, 1.0};
  std::sort(strengths.begin(), strengths.end());
  const auto quantile = [&](double share) { return strengths[static_cast<std::size_t>(share * (strengths.size() - 1.0))]; };
  Scale scale{quantile(0.01), quantile(0.99)};
  if (scale.high - scale.low < 0.1) scale = {scale.low - 0.05, scale.high + 0.05};
  return scale;
}

void draw_field(Canvas& canvas, const CanvasBox& box, const Extent& extent, const MagneticMap& map, double height,
                const Scale& strength) {
  canvas.fill(box, {240, 240, 240});
  canvas.shade(box, [&](CanvasPoint point, Color& color) {
    const double x = extent.x_low + (point.x - box.left) / box.width() * (extent.x_high - extent.x_low);
    const double y = extent.y_high - (point.y - box.top) / box.height() * (extent.y_high - extent.y_low);
    const auto value = map.query({x, y, height}, FieldInterpolation::bilinear);
    if (value) color = heat_color(strength.share(value->field_ut.norm()));
    return value.has_value();
  });
}

void draw_track(Canvas& canvas, const Axes& axes, const Trajectory& trajectory, Color color, double width) {
  std::vector<CanvasPoint> points;
  for (const StampedPose& pose : trajectory) {
    if (pose.pose.position.allFinite()) points.push_back(axes.at(pose.pose.position.x(), pose.pose.position.y()));
  }
  canvas.polyline(points, color, width);
}

}  // namespace

void draw_map_picture(const std::filesystem::path& path, const MagneticMap* map, const Trajectory& truth,
                      const std::vector<PictureSeries>& series) {
  constexpr double kPlotWidth = 1200.0;
  constexpr double kMaxHeight = 1000.0;
  constexpr double kMinHeight = 260.0;
  Extent extent = extent_of(map, truth, series);
  const double wide = extent.x_high - extent.x_low;
  const double high = extent.y_high - extent.y_low;
  const double pixels_a_metre = std::min(kPlotWidth / wide, kMaxHeight / high);
  const double plot_width = std::max(500.0, wide * pixels_a_metre);
  const double plot_height = std::max(kMinHeight, high * pixels_a_metre);
  // Where the sheet is wider or higher than the site, show more of its surroundings: metres stay metres both ways.
  const double spare_x = 0.5 * (plot_width / pixels_a_metre - wide);
  const double spare_y = 0.5 * (plot_height / pixels_a_metre - high);
  extent = {extent.x_low - spare_x, extent.x_high + spare_x, extent.y_low - spare_y, extent.y_high + spare_y};

  constexpr double kLegendTop = 44.0;
  constexpr double kPlotTop = 100.0;
  const CanvasBox box{100.0, kPlotTop, 100.0 + plot_width, kPlotTop + plot_height};
  Canvas canvas(box.right + 120.0, box.bottom + 70.0);
  canvas.text({box.left, 14.0}, map != nullptr ? "Magnetic map and trajectories" : "Trajectories", ink::title, ink::text,
              Anchor::begin, Anchor::begin);

  Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
  const int x_ticks = static_cast<int>(plot_width / 110.0);
  const int y_ticks = std::max(2, static_cast<int>(plot_height / 80.0));
  if (map != nullptr) {
    const Scale strength = strength_range(*map);
    draw_field(canvas, box, extent, *map, mean_height(truth, series), strength);
    draw_color_bar(canvas, {box.right + 30.0, box.top + 24.0, box.right + 52.0, box.bottom}, strength, "|B| µT");
  } else {
    axes.grid(x_ticks, y_ticks);
  }

  // Lines that lie on each other are told apart by their width: the truth widest, later estimates ever narrower on top.
  canvas.clip(box);
  std::vector<LegendEntry> legend;
  constexpr double kTruthWidth = 7.5;
  if (!truth.empty()) {
    draw_track(canvas, axes, truth, ink::white, kTruthWidth + 2.0);
    draw_track(canvas, axes, truth, ink::truth, kTruthWidth);
    legend.push_back({"truth", ink::truth, kTruthWidth});
  }
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double width = std::max(1.3, 5.0 - 2.0 * static_cast<double>(i));
    if (truth.empty()) draw_track(canvas, axes, series[i].trajectory, ink::white, width + 2.0);
    draw_track(canvas, axes, series[i].trajectory, series_color(i), width);
    legend.push_back({series[i].name, series_color(i), width});
  }
  const Trajectory& leading = truth.empty() && !series.empty() ? series.front().trajectory : truth;
  if (!leading.empty()) {
    const Vector3& start = leading.front().pose.position;
    canvas.disk(axes.at(start.x(), start.y()), 7.0, ink::white);
    canvas.disk(axes.at(start.x(), start.y()), 5.0, ink::truth);
    canvas.disk(axes.at(start.x(), start.y()), 2.5, ink::white);
  }
  canvas.unclip();
  axes.labels("x, m", "y, m", x_ticks, y_ticks);
  draw_legend(canvas, {box.left, kLegendTop}, box.right, legend);
  canvas.save(path);
}

}  // namespace lodestone
