#include <algorithm>

#include "core/geometry/pose_spacing.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/color_bar.h"
#include "tools/plotting/pictures.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone {

namespace {

/// The extent of ground truth and map. A lost estimate may be far away and is clipped at the edge.
PlanExtent drawn_extent(const MagneticMap* map, const Trajectory& truth, const std::vector<PictureSeries>& series) {
  PlanExtent extent;
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
  extent.widen(0.5, 0.02);
  return extent;
}

struct StrengthRange {
  Scale scale;
  bool is_cut = false;  ///< a node is stronger
};

StrengthRange strength_range(const MagneticMap& map) {
  std::vector<float> strengths;
  map.for_each_node([&](const Eigen::Vector4f& node) {
    if (node(3) <= map.max_sigma_ut()) strengths.push_back(node.head<3>().norm());
  });
  if (strengths.empty()) return {};
  const Scale scale = strength_scale(cv::Mat1f(strengths));
  return {scale, *std::max_element(strengths.begin(), strengths.end()) > 1.001 * scale.high};
}

void draw_field(Canvas& canvas, const PlanSheet& sheet, const MagneticMap& map, double height, const Scale& strength) {
  canvas.fill(sheet.box, {240, 240, 240});
  canvas.shade(
      sheet.box,
      [&](CanvasPoint point) {
        return strength.share(strength_at(map, {sheet.x_at(point.x), sheet.y_at(point.y), height}));
      },
      ColorRamp::heat);
}

/// The longest time between two poses that a line joins: where an estimator was lost, there are none.
double longest_step_s(const Trajectory& trajectory) {
  return std::max(1.0, 5.0 * to_seconds(pose_spacing(trajectory)));
}

void draw_track(Canvas& canvas, const Axes& axes, const Trajectory& trajectory, Color color, double width) {
  const double longest_s = longest_step_s(trajectory);
  std::vector<CanvasPoint> points;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (i > 0 && to_seconds(trajectory[i].time - trajectory[i - 1].time) > longest_s) {
      canvas.polyline(points, color, width);
      points.clear();
    }
    const Vector3& position = trajectory[i].pose.position;
    if (position.allFinite()) points.push_back(axes.at(position.x(), position.y()));
  }
  canvas.polyline(points, color, width);
}

}  // namespace

void draw_map_picture(const std::filesystem::path& path, const MagneticMap* map, const Trajectory& truth,
                      const std::vector<PictureSeries>& series) {
  constexpr double kLegendTop = 44.0;
  const Trajectory& leading = truth.empty() && !series.empty() ? series.front().trajectory : truth;
  const bool tracks = !truth.empty() || !series.empty();
  const double plot_top = tracks ? 100.0 : 60.0;  // a map alone has no legend
  const PlanSheet sheet = plan_sheet(drawn_extent(map, truth, series), plot_top);
  const CanvasBox& box = sheet.box;
  const PlanExtent& extent = sheet.extent;
  Canvas canvas(sheet.width, sheet.height);
  canvas.text({box.left, 14.0},
              map == nullptr ? "Trajectories"
              : tracks       ? "Magnetic map and trajectories"
                             : "Magnetic map",
              ink::title, ink::text, Anchor::begin, Anchor::begin);

  Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
  if (map != nullptr) {
    const StrengthRange strength = strength_range(*map);
    draw_field(canvas, sheet, *map, mean_height(leading), strength.scale);
    draw_color_bar(canvas, sheet.color_bar(), strength.scale, ColorRamp::heat, "|B| µT", strength.is_cut);
  } else {
    axes.grid(sheet.x_ticks, sheet.y_ticks);
  }

  // Widths distinguish overlapping lines: the ground truth is widest, later estimates are narrower and on top.
  canvas.clip(box);
  std::vector<LegendEntry> legend;
  constexpr double kTruthWidth = 7.5;
  if (!truth.empty()) {
    draw_track(canvas, axes, truth, ink::white, kTruthWidth + 2.0);
    draw_track(canvas, axes, truth, ink::truth, kTruthWidth);
    legend.push_back({"truth", ink::truth, kTruthWidth});
  }
  const std::vector<Color> colors = colors_of(series);
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double width = std::max(1.3, 5.0 - 2.0 * static_cast<double>(i));
    if (truth.empty()) draw_track(canvas, axes, series[i].trajectory, ink::white, width + 2.0);
    draw_track(canvas, axes, series[i].trajectory, colors[i], width);
    legend.push_back({series[i].name, colors[i], width});
  }
  if (!leading.empty()) {
    const Vector3& start = leading.front().pose.position;
    canvas.disk(axes.at(start.x(), start.y()), 7.0, ink::white);
    canvas.disk(axes.at(start.x(), start.y()), 5.0, ink::truth);
    canvas.disk(axes.at(start.x(), start.y()), 2.5, ink::white);
  }
  canvas.unclip();
  axes.labels("x, m", "y, m", sheet.x_ticks, sheet.y_ticks);
  if (tracks) draw_legend(canvas, {box.left, kLegendTop}, box.right, legend);
  canvas.save(path);
}

}  // namespace lodestone
