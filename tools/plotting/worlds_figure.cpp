#include <algorithm>
#include <cmath>

#include "tools/plotting/page.h"
#include "tools/plotting/plan_figures.h"
#include "tools/plotting/plan_parts.h"

namespace lodestone::figures {

namespace {

constexpr double kWorldLeft = 58.0;   // left margin of a cell: numbers and title of the y axis
constexpr double kWorldRight = 88.0;  // right margin of a cell: colour bar
constexpr double kWorldTitle = 30.0;
constexpr double kBelow = 62.0;
constexpr double kWorldLeastHeight = 84.0;
constexpr double kMostHeight = 300.0;
constexpr double kLong = 2.5;  // aspect ratio above which a world gets half a page
constexpr int kUnits = 6;      // width of a row in units: a long world has 3, others 2

struct Cell {
  const WorldPanel* panel = nullptr;
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;  // width of the plan's box
  double height = 0.0;
};

PlanExtent extent_of_world(const WorldPanel& panel) {
  std::vector<Vector3> all;
  for (const WorldTrack& track : panel.tracks) all.insert(all.end(), track.position.begin(), track.position.end());
  return extent_of(panel.strength_ut, all);
}

/// Places worlds in rows: compact ones first, three per row, then long ones, two per row. Returns the total height.
double place(const std::vector<WorldPanel>& panels, std::vector<Cell>& cells) {
  double top = 0.0;
  for (const bool is_long : {false, true}) {
    std::vector<const WorldPanel*> group;
    for (const WorldPanel& panel : panels) {
      const PlanExtent extent = extent_of_world(panel);
      if ((extent.width() > kLong * extent.height()) == is_long) group.push_back(&panel);
    }
    const std::size_t a_shelf = kUnits / (is_long ? 3 : 2);
    const double cell = kPageWidth / static_cast<double>(a_shelf);
    for (std::size_t first = 0; first < group.size(); first += a_shelf) {
      double highest = 0.0;
      const std::size_t last = std::min(group.size(), first + a_shelf);
      for (std::size_t i = first; i < last; ++i) {
        const PlanExtent extent = extent_of_world(*group[i]);
        Cell one{group[i], cell * static_cast<double>(i - first), top, cell - kWorldLeft - kWorldRight, 0.0};
        one.height = std::clamp(one.width * extent.height() / extent.width(), kWorldLeastHeight, kMostHeight);
        highest = std::max(highest, one.height);
        cells.push_back(one);
      }
      for (std::size_t i = cells.size() - (last - first); i < cells.size(); ++i) cells[i].height = highest;
      top += kWorldTitle + highest + kBelow;
    }
  }
  return top;
}

}  // namespace

void draw_worlds(const std::filesystem::path& path, const std::vector<WorldPanel>& panels) {
  std::vector<Cell> cells;
  const double height = place(panels, cells);
  Canvas canvas(kPageWidth, std::max(60.0, height));
  for (const Cell& cell : cells) {
    const WorldPanel& panel = *cell.panel;
    const CanvasBox box{cell.left + kWorldLeft, cell.top + kWorldTitle, cell.left + kWorldLeft + cell.width,
                        cell.top + kWorldTitle + cell.height};
    const PlanExtent extent = extent_of_world(panel).filling(cell.width / cell.height);
    const Scale strength = strength_scale(panel.strength_ut.values);
    draw_raster(canvas, box, extent, panel.strength_ut, strength, ColorRamp::heat);
    Axes axes(canvas, box, {extent.x_low, extent.x_high}, {extent.y_low, extent.y_high});
    std::vector<LegendEntry> legend;
    for (std::size_t i = 0; i < panel.tracks.size(); ++i) {
      // The first drive is dark, others have the colours of series: both are visible on the pale field.
      const Color color = i == 0 ? ink::truth : series_color(i - 1);
      draw_track(canvas, axes, panel.tracks[i].position, color, 2.2);
      legend.push_back({panel.tracks[i].name, color, 2.5});
    }
    axes.ticks(true, true, tick_count(cell.width, 62.0), tick_count(cell.height, 36.0));
    const double middle = 0.5 * (box.top + box.bottom);
    canvas.vertical_text({cell.left + 10.0, middle}, "y, m", ink::letter, ink::text);
    canvas.text({0.5 * (box.left + box.right), box.bottom + 32.0}, "x, m", ink::letter, ink::text, Anchor::middle,
                Anchor::begin);
    canvas.text({box.left, box.top - 9.0}, panel.title, ink::letter, ink::text, Anchor::begin, Anchor::end);
    const double after = box.left + canvas.text_width(panel.title, ink::letter) + 18.0;
    draw_legend(canvas, {after, box.top - 27.0}, kPageWidth, legend);
    if (std::isfinite(quantile(panel.strength_ut.values, 0.5)))
      draw_upright_color_bar(canvas, {box.right + 12.0, box.top, box.right + 26.0, box.bottom}, strength,
                             ColorRamp::heat, "|B|, µT");
  }
  canvas.save(path);
}

}  // namespace lodestone::figures
