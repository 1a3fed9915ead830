#include "tools/plotting/error_distribution.h"

#include <algorithm>
#include <cmath>

#include "tools/plotting/axes.h"
#include "tools/plotting/error_scale.h"
#include "tools/plotting/method_style.h"
#include "tools/plotting/page.h"

namespace lodestone::figures {

namespace {

constexpr double kColumnWidth = 504.0;
constexpr double kDistributionLeft = 76.0;
constexpr double kDistributionRight = 14.0;
constexpr double kDistributionGap = 24.0;
constexpr double kDistributionPanelHeight = 210.0;
constexpr double kRowGap = 66.0;  // space for the axis numbers above and the title of the panel below

/// Most points drawn of a distribution; more would only increase the file.
constexpr std::size_t kMostPoints = 600;

void draw_curve(Axes& axes, const Scale& scale, const MethodErrors& method, const MethodStyle& style) {
  std::vector<double> sorted;
  for (const double error : method.error_m) {
    if (std::isfinite(error)) sorted.push_back(error);
  }
  std::sort(sorted.begin(), sorted.end());
  const auto whole = static_cast<double>(std::max({method.expected, method.error_m.size(), std::size_t{1}}));
  std::vector<double> x{scale.low};
  std::vector<double> y{0.0};
  const std::size_t stride = std::max<std::size_t>(1, sorted.size() / kMostPoints);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i % stride != 0 && i + 1 != sorted.size()) continue;
    x.push_back(std::max(sorted[i], scale.low));
    y.push_back(static_cast<double>(i + 1) / whole);
  }
  x.push_back(std::max(scale.high, x.back()));
  y.push_back(y.back());
  axes.curve(x, y, style.color, style.width + 0.4, style.stroke);
}

}  // namespace

void draw_error_distributions(const std::filesystem::path& path, const std::vector<DistributionPanel>& panels) {
  std::vector<std::vector<double>> errors;
  std::vector<std::string> methods;
  for (const DistributionPanel& panel : panels) {
    for (const MethodErrors& one : panel.methods) {
      errors.push_back(one.error_m);
      methods.push_back(one.method);
    }
  }
  methods = legend_order(methods);
  const std::vector<MethodStyle> styles = method_styles(methods);
  const Scale scale = logarithmic_error_scale(errors);
  const std::size_t count = std::max<std::size_t>(1, panels.size());
  const std::size_t columns = count == 4 ? 2 : std::min<std::size_t>(3, count);
  const std::size_t rows = (count + columns - 1) / columns;
  const double page = columns == 1 ? kColumnWidth : kPageWidth;
  const double width =
      (page - kDistributionLeft - kDistributionRight - kDistributionGap * static_cast<double>(columns - 1)) /
      static_cast<double>(columns);

  std::vector<LegendEntry> legend;
  for (const MethodStyle& style : styles)
    legend.push_back({style.label, style.color, style.width + 0.5, false, style.stroke});
  Canvas measure(page, 100.0);
  const double top = draw_legend(measure, {kDistributionLeft, 4.0}, page - kDistributionRight, legend) + 38.0;
  Canvas canvas(page, top + static_cast<double>(rows) * (kDistributionPanelHeight + kRowGap) - kRowGap + 62.0);
  draw_legend(canvas, {kDistributionLeft, 4.0}, page - kDistributionRight, legend);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::size_t column = i % columns;
    const double left = kDistributionLeft + static_cast<double>(column) * (width + kDistributionGap);
    const double upper = top + static_cast<double>(i / columns) * (kDistributionPanelHeight + kRowGap);
    const CanvasBox box{left, upper, left + width, upper + kDistributionPanelHeight};
    Axes axes(canvas, box, scale, {0.0, 1.0});
    axes.grid(5, 5);
    for (std::size_t k = methods.size(); k-- > 0;) {
      for (const MethodErrors& one : panels[i].methods) {
        if (one.method == methods[k]) draw_curve(axes, scale, one, styles[k]);
      }
    }
    axes.ticks(true, column == 0, 5, 5);
    const double middle = 0.5 * (box.left + box.right);
    canvas.text({middle, box.top - 9.0}, panels[i].title, ink::letter, ink::text, Anchor::middle, Anchor::end);
    const bool lowest = i + columns >= panels.size();
    if (lowest) {
      canvas.text({middle, box.bottom + 34.0}, "position error, m", ink::letter, ink::text, Anchor::middle,
                  Anchor::begin);
    }
    if (column == 0) {
      canvas.vertical_text({14.0, 0.5 * (box.top + box.bottom)}, "share of scans", ink::letter, ink::text);
    }
  }
  canvas.save(path);
}

}  // namespace lodestone::figures
