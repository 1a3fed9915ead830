#include "tools/plotting/error_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tools/plotting/axes.h"
#include "tools/plotting/error_scale.h"
#include "tools/plotting/method_style.h"
#include "tools/plotting/page.h"
#include "tools/plotting/window_statistics.h"

namespace lodestone::figures {

namespace {

constexpr double kGridLeft = 88.0;
constexpr double kStrip = 30.0;  // width of the rows' headings, at the right
constexpr double kGridPanelHeight = 216.0;
constexpr double kGridGap = 22.0;
constexpr int kTimeTicks = 6;
constexpr int kErrorTicks = 5;

struct SmoothSeries {
  std::string method;
  WindowStatistics statistics;
};

void draw_band(Axes& axes, const WindowStatistics& statistics, Color color) {
  std::vector<double> low;
  std::vector<double> high;
  for (std::size_t i = 0; i < statistics.mean.size(); ++i) {
    low.push_back(std::max(0.0, statistics.mean[i] - statistics.standard_deviation[i]));
    high.push_back(statistics.mean[i] + statistics.standard_deviation[i]);
    if (!std::isfinite(statistics.mean[i])) low.back() = high.back() = statistics.mean[i];
  }
  axes.ribbon(statistics.time_s, low, high, color, 0.25);
}

}  // namespace

void draw_error_grid(const std::filesystem::path& path, const ErrorGrid& grid) {
  const std::size_t columns = grid.columns.size();
  const std::size_t rows = grid.rows.size();
  if (grid.panels.size() != rows * columns || grid.panels.empty()) {
    throw std::invalid_argument("draw_error_grid: expected rows x columns panels");
  }
  std::vector<std::vector<SmoothSeries>> panels;
  std::vector<std::vector<double>> means;
  std::vector<std::string> methods;
  std::vector<double> begin(columns, 0.0);
  std::vector<double> end(columns, 0.0);
  bool shaded = false;
  for (std::size_t i = 0; i < grid.panels.size(); ++i) {
    panels.emplace_back();
    for (const ErrorSeries& one : grid.panels[i].series) {
      panels.back().push_back({one.method, window_statistics(one.time_s, one.error_m, grid.window_s)});
      means.push_back(panels.back().back().statistics.mean);
      methods.push_back(one.method);
      if (one.time_s.empty()) continue;
      begin[i % columns] = std::min(begin[i % columns], one.time_s.front());
      end[i % columns] = std::max(end[i % columns], one.time_s.back());
    }
    shaded = shaded || !grid.panels[i].degenerate.empty();
  }
  methods = legend_order(methods);
  const std::vector<MethodStyle> styles = method_styles(methods);
  const Scale error = error_scale(means);

  const double right = kPageWidth - kStrip;
  const double width = (right - kGridLeft - kGridGap * static_cast<double>(columns - 1)) / static_cast<double>(columns);
  std::vector<LegendEntry> legend;
  for (const MethodStyle& style : styles)
    legend.push_back({style.label, style.color, style.width + 0.5, false, style.stroke});
  if (!styles.empty()) legend.push_back({"± 1 σ in the window", {200, 213, 228}, 0.0, true});
  if (shaded) legend.push_back({"LiDAR degenerate", {230, 230, 230}, 0.0, true});

  // The legend may need a second row. Its height is known only after the layout.
  Canvas measure(kPageWidth, 100.0);
  const double top = draw_legend(measure, {kGridLeft, 4.0}, right, legend) + 40.0;
  Canvas canvas(kPageWidth, top + static_cast<double>(rows) * (kGridPanelHeight + kGridGap) - kGridGap + 62.0);
  draw_legend(canvas, {kGridLeft, 4.0}, right, legend);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::size_t row = i / columns;
    const std::size_t column = i % columns;
    const double left = kGridLeft + static_cast<double>(column) * (width + kGridGap);
    const double upper = top + static_cast<double>(row) * (kGridPanelHeight + kGridGap);
    const CanvasBox box{left, upper, left + width, upper + kGridPanelHeight};
    Axes axes(canvas, box, {begin[column], end[column] > begin[column] ? end[column] : begin[column] + 1.0}, error);
    for (const auto& [from, to] : grid.panels[i].degenerate) axes.band(from, to, ink::shade, 0.22);
    axes.grid(kTimeTicks, kErrorTicks);
    // From last to first, so that the first series of the legend is on top.
    for (const bool band : {true, false}) {
      for (std::size_t k = methods.size(); k-- > 0;) {
        for (const SmoothSeries& one : panels[i]) {
          if (one.method != methods[k]) continue;
          if (band) draw_band(axes, one.statistics, styles[k].color);
          if (!band)
            axes.curve(one.statistics.time_s, one.statistics.mean, styles[k].color, styles[k].width, styles[k].stroke);
        }
      }
    }
    if (panels[i].empty()) {
      canvas.text({0.5 * (box.left + box.right), 0.5 * (box.top + box.bottom)}, "no run", ink::letter, ink::frame,
                  Anchor::middle, Anchor::middle);
    }
    axes.ticks(row + 1 == rows, column == 0, kTimeTicks, kErrorTicks);
    if (row == 0) {
      canvas.text({0.5 * (box.left + box.right), box.top - 10.0}, grid.columns[column], ink::letter, ink::text,
                  Anchor::middle, Anchor::end);
    }
    if (row + 1 == rows) {
      canvas.text({0.5 * (box.left + box.right), box.bottom + 34.0}, "time, s", ink::letter, ink::text, Anchor::middle,
                  Anchor::begin);
    }
    const double middle = 0.5 * (box.top + box.bottom);
    if (column == 0) canvas.vertical_text({14.0, middle}, "position error, m", ink::letter, ink::text);
    if (column + 1 == columns) canvas.vertical_text({right + 16.0, middle}, grid.rows[row], ink::letter, ink::text);
  }
  canvas.save(path);
}

}  // namespace lodestone::figures
