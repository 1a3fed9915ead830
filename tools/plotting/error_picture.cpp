#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/middle_value.h"
#include "tools/plotting/axes.h"
#include "tools/plotting/method_style.h"
#include "tools/plotting/pictures.h"

namespace lodestone {

namespace {

constexpr double kWidth = 1320.0;
constexpr double kLeft = 100.0;
constexpr double kLegendTop = 46.0;
constexpr double kRight = kWidth - 40.0;

double value_at(std::vector<double> values, double share) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return !std::isfinite(value); }),
               values.end());
  return values.empty() ? 0.0 : value_at_share(values, share);
}

std::size_t lost_scans(const PictureSeries& series) {
  return static_cast<std::size_t>(
      std::count_if(series.error_m.begin(), series.error_m.end(), [](double error) { return !std::isfinite(error); }));
}

bool any_is_lost(const std::vector<PictureSeries>& series) {
  return std::any_of(series.begin(), series.end(), [](const PictureSeries& one) { return lost_scans(one) > 0; });
}

/// Name, colour, and the number of lost scans, if any.
std::vector<LegendEntry> legend_of(const std::vector<PictureSeries>& series, const std::vector<Color>& colors) {
  std::vector<LegendEntry> legend;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const std::size_t lost = lost_scans(series[i]);
    const std::string note =
        lost > 0 ? fmt::format(" (lost in {} of {} scans)", lost, series[i].error_m.size()) : std::string();
    legend.push_back({series[i].name + note, colors[i], 2.5});
  }
  return legend;
}

/// The upper edge of the axes below a legend, which may have several rows.
double top_below(const std::vector<LegendEntry>& legend, double right) {
  Canvas measure(right + kLeft, 100.0);
  return kLegendTop + std::max(24.0, draw_legend(measure, {kLeft, kLegendTop}, right, legend)) + 30.0;
}

/// Linear if all errors are of similar size; logarithmic if one estimator's errors are many times larger.
Scale error_scale(const std::vector<PictureSeries>& series) {
  double smallest_median = 0.0;
  double low = 0.0;
  double high = 0.0;
  for (const PictureSeries& one : series) {
    if (lost_scans(one) == one.error_m.size()) continue;
    const double median = value_at(one.error_m, 0.5);
    const double fifth = value_at(one.error_m, 0.05);
    if (smallest_median == 0.0 || median < smallest_median) smallest_median = median;
    if (low == 0.0 || fifth < low) low = fifth;
    high = std::max(high, value_at(one.error_m, 1.0));
  }
  if (!(high > 0.0)) return {0.0, 1.0};
  if (high < 15.0 * smallest_median) return {0.0, 1.08 * high};
  const double floor = std::pow(10.0, std::floor(std::log10(std::clamp(low, 1e-4, 0.1 * high))));
  return {floor, std::pow(10.0, std::ceil(std::log10(high) + 0.02)), true};
}

/// Intervals of at least one scan with a degenerate direction.
std::vector<std::pair<double, double>> degenerate_intervals(const PictureSeries& series) {
  std::vector<std::pair<double, double>> intervals;
  for (std::size_t i = 0; i < std::min(series.step_time_s.size(), series.degenerate_directions.size()); ++i) {
    if (series.degenerate_directions[i] == 0) continue;
    const double begin = i > 0 ? series.step_time_s[i - 1] : series.step_time_s[i];
    if (!intervals.empty() && intervals.back().second >= begin) {
      intervals.back().second = series.step_time_s[i];
    } else {
      intervals.emplace_back(begin, series.step_time_s[i]);
    }
  }
  return intervals;
}

/// Counts as steps: each value is valid from the previous scan on.
void step_curve(Axes& axes, const std::vector<double>& time, const std::vector<int>& counts, Color color) {
  std::vector<double> x;
  std::vector<double> y;
  for (std::size_t i = 0; i < std::min(time.size(), counts.size()); ++i) {
    if (i > 0) {
      x.push_back(time[i - 1]);
      y.push_back(counts[i]);
    }
    x.push_back(time[i]);
    y.push_back(counts[i]);
  }
  axes.curve(x, y, color, 1.6);
}

void panel_title(Canvas& canvas, const CanvasBox& box, const std::string& title) {
  canvas.text({box.left, box.top - 7.0}, title, ink::letter, ink::text, Anchor::begin, Anchor::end);
}

/// Draws in reverse order, so that the first series is on top.
template <class Function>
void draw_in_reverse(const std::vector<PictureSeries>& series, Function draw) {
  for (std::size_t i = series.size(); i-- > 0;) draw(i, series[i]);
}

}  // namespace

std::vector<Color> colors_of(const std::vector<PictureSeries>& series) {
  std::vector<std::string> names;
  for (const PictureSeries& one : series) names.push_back(one.name);
  std::vector<Color> colors;
  for (const std::size_t index : figures::method_colors(names)) colors.push_back(series_color(index));
  return colors;
}

void draw_error_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series) {
  double end = 0.0;
  bool magnetic = false;
  for (const PictureSeries& one : series) {
    if (!one.error_time_s.empty()) end = std::max(end, one.error_time_s.back());
    if (!one.step_time_s.empty()) end = std::max(end, one.step_time_s.back());
    magnetic = magnetic || !one.magnetic_weight.empty();
  }
  const Scale time{0.0, end > 0.0 ? end : 1.0};
  constexpr int kTimeTicks = 10;
  const std::vector<Color> colors = colors_of(series);
  std::vector<LegendEntry> legend = legend_of(series, colors);
  const auto degenerate =
      series.empty() ? std::vector<std::pair<double, double>>() : degenerate_intervals(series.front());
  if (!degenerate.empty()) {
    legend.push_back({"LiDAR degenerate (" + series.front().name + ")", {234, 234, 234}, 0.0, true});
  }
  const double top = top_below(legend, kRight);
  const CanvasBox error_box{kLeft, top, kRight, top + 420.0};
  const CanvasBox count_box{kLeft, error_box.bottom + 32.0, kRight, error_box.bottom + 132.0};
  const CanvasBox weight_box{kLeft, count_box.bottom + 32.0, kRight, count_box.bottom + 132.0};
  const CanvasBox& lowest = magnetic ? weight_box : count_box;
  Canvas canvas(kWidth, lowest.bottom + 70.0);
  const std::string title = "Position error over time";
  canvas.text({kLeft, 14.0}, any_is_lost(series) ? title + "; no line where an estimator is lost" : title, ink::title,
              ink::text, Anchor::begin, Anchor::begin);

  const Scale error = error_scale(series);
  Axes error_axes(canvas, error_box, time, error);
  Axes count_axes(canvas, count_box, time, {0.0, 6.3});
  Axes weight_axes(canvas, weight_box, time, {0.0, 1.05});
  for (const auto& [from, to] : degenerate) error_axes.band(from, to, ink::shade, 0.2);
  error_axes.grid(kTimeTicks, 6);
  count_axes.grid(kTimeTicks, 4);
  if (magnetic) weight_axes.grid(kTimeTicks, 2);
  draw_in_reverse(series, [&](std::size_t i, const PictureSeries& one) {
    error_axes.curve(one.error_time_s, one.error_m, colors[i], 1.8);
    step_curve(count_axes, one.step_time_s, one.degenerate_directions, colors[i]);
    if (!one.magnetic_weight.empty()) weight_axes.curve(one.step_time_s, one.magnetic_weight, colors[i], 1.6);
  });
  error_axes.labels("", "position error, m", kTimeTicks, 6);
  count_axes.labels(magnetic ? "" : "time, s", "", kTimeTicks, 4);
  panel_title(canvas, count_box, "number of degenerate directions, of six");
  if (magnetic) {
    weight_axes.labels("time, s", "", kTimeTicks, 2);
    panel_title(canvas, weight_box, "mean magnetic weight");
  }

  draw_legend(canvas, {kLeft, kLegendTop}, kRight, legend);
  canvas.save(path);
}

void draw_distribution_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series) {
  const std::vector<Color> colors = colors_of(series);
  const std::vector<LegendEntry> legend = legend_of(series, colors);
  const double top = top_below(legend, kLeft + 760.0);
  const CanvasBox box{kLeft, top, kLeft + 760.0, top + 480.0};
  Canvas canvas(box.right + 40.0, box.bottom + 70.0);
  canvas.text({kLeft, 14.0},
              any_is_lost(series) ? "Share of all scans within an error; lost scans are beyond every error"
                                  : "Share of scans within an error",
              ink::title, ink::text, Anchor::begin, Anchor::begin);
  const Scale error = error_scale(series);
  Axes axes(canvas, box, error, {0.0, 102.0});
  axes.grid(8, 6);
  draw_in_reverse(series, [&](std::size_t i, const PictureSeries& one) {
    std::vector<double> sorted = one.error_m;
    sorted.erase(std::remove_if(sorted.begin(), sorted.end(), [](double value) { return !std::isfinite(value); }),
                 sorted.end());
    std::sort(sorted.begin(), sorted.end());
    std::vector<double> x{error.low};
    std::vector<double> y{0.0};
    for (std::size_t k = 0; k < sorted.size(); ++k) {
      x.push_back(sorted[k]);
      y.push_back(100.0 * static_cast<double>(k + 1) / static_cast<double>(one.error_m.size()));
    }
    x.push_back(error.high);
    y.push_back(y.back());
    axes.curve(x, y, colors[i], 2.4);
  });
  axes.labels("position error, m", "share of scans, %", 8, 6);
  draw_legend(canvas, {kLeft, kLegendTop}, box.right, legend);
  canvas.save(path);
}

}  // namespace lodestone
