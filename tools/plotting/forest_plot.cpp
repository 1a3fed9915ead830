#include "tools/plotting/forest_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/plotting/axes.h"
#include "tools/plotting/page.h"

namespace lodestone::figures {

namespace {

constexpr double kRow = 40.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 66.0;
constexpr double kMargin = 14.0;
constexpr double kLeastSpan = 1.1;   // smallest half range of the axis, as a factor
constexpr double kMostRatio = 50.0;  // largest ratio on the axis
constexpr double kSpread = 11.0;     // half height of the points of single pairs

std::string row_text(const ForestRow& row) {
  std::string text;
  if (row.estimate) text = fmt::format("{:.3f}", row.estimate->ratio);
  if (row.estimate && row.estimate->low)
    text += fmt::format("  [{:.3f}, {:.3f}]", *row.estimate->low, *row.estimate->high);
  return text + (text.empty() || row.note.empty() ? "" : "  ") + row.note;
}

/// Contains every ratio and estimate. Intervals of few pairs can be huge; they extend the axis at most to twice that
/// range.
Scale axis_of(const std::vector<ForestRow>& rows) {
  double least = 0.0;  // logarithms
  double most = 0.0;
  double low = 0.0;
  double high = 0.0;
  for (const ForestRow& row : rows) {
    for (const double ratio : row.ratios) {
      least = std::min(least, std::log(ratio));
      most = std::max(most, std::log(ratio));
    }
    if (!row.estimate || !row.estimate->low) continue;
    low = std::min(low, std::log(*row.estimate->low));
    high = std::max(high, std::log(*row.estimate->high));
  }
  const double span = std::max(most - least, std::log(kLeastSpan));
  const double bound = std::log(kMostRatio);
  const double begin = std::clamp(std::min(least, std::max(low, least - span)), -bound, bound);
  const double end = std::clamp(std::max(most, std::min(high, most + span)), -bound, bound);
  const double margin = 0.06 * std::max(end - begin, 2.0 * std::log(kLeastSpan));
  return {std::exp(std::min(begin, -std::log(kLeastSpan)) - margin),
          std::exp(std::max(end, std::log(kLeastSpan)) + margin), true};
}

class ForestDrawing {
 public:
  ForestDrawing(Canvas& canvas, const CanvasBox& box, const Scale& scale) : canvas_(canvas), box_(box), scale_(scale) {}

  double at(double ratio) const { return box_.left + std::clamp(scale_.share(ratio), 0.0, 1.0) * box_.width(); }
  bool beyond(double ratio) const { return ratio < scale_.low || ratio > scale_.high; }

  /// `middle`: of the sheet, where the title is centred. The title may be wider than the axis.
  void axis(const std::string& title, double middle) {
    for (const double tick : ratio_ticks(scale_.low, scale_.high)) {
      canvas_.line({at(tick), box_.top}, {at(tick), box_.bottom}, ink::grid, 1.0);
      canvas_.line({at(tick), box_.bottom}, {at(tick), box_.bottom + 5.0}, ink::frame, 1.0);
      canvas_.text({at(tick), box_.bottom + 10.0}, tick_text(tick), ink::letter, ink::text, Anchor::middle,
                   Anchor::begin);
    }
    canvas_.line({at(1.0), box_.top}, {at(1.0), box_.bottom}, ink::text, 1.5);
    canvas_.text({at(1.0) - 10.0, box_.top - 8.0}, "better", ink::letter, ink::frame, Anchor::end, Anchor::end);
    canvas_.text({at(1.0) + 10.0, box_.top - 8.0}, "worse", ink::letter, ink::frame, Anchor::begin, Anchor::end);
    canvas_.text({middle, box_.bottom + 36.0}, title, ink::letter, ink::text, Anchor::middle, Anchor::begin);
  }

  /// Pairs one below the other in their order, so that equal ratios do not overlap.
  void pairs(const std::vector<double>& ratios, double y) {
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      const double share = ratios.size() < 2 ? 0.5 : static_cast<double>(i) / static_cast<double>(ratios.size() - 1);
      if (!beyond(ratios[i])) canvas_.disk({at(ratios[i]), y + (2.0 * share - 1.0) * kSpread}, 2.2, {170, 190, 208});
      if (beyond(ratios[i])) arrow(ratios[i], y + (2.0 * share - 1.0) * kSpread, {170, 190, 208}, 4.0);
    }
  }

  void estimate(const RatioEstimate& estimate, double y) {
    const Color color = series_color(0);
    if (estimate.low) {
      canvas_.line({at(*estimate.low), y}, {at(*estimate.high), y}, color, 2.0);
      for (const double end : {*estimate.low, *estimate.high}) {
        if (beyond(end)) arrow(end, y, color, 7.0);
        if (!beyond(end)) canvas_.line({at(end), y - 6.0}, {at(end), y + 6.0}, color, 2.0);
      }
    }
    const double x = at(estimate.ratio);
    if (beyond(estimate.ratio)) {
      arrow(estimate.ratio, y, color, 9.0);
    } else {
      canvas_.fill({x - 5.0, y - 5.0, x + 5.0, y + 5.0}, color);
    }
  }

 private:
  void arrow(double ratio, double y, Color color, double size) {
    const double x = at(ratio);
    const double back = ratio < scale_.low ? x + size : x - size;
    canvas_.polygon({{x, y}, {back, y - 0.6 * size}, {back, y + 0.6 * size}}, color);
  }

  Canvas& canvas_;
  CanvasBox box_;
  Scale scale_;
};

}  // namespace

std::vector<double> ratio_ticks(double low, double high) {
  if (high < 1.6 * low) return round_ticks(low, high, 6);
  std::vector<double> digits{1.0, 2.0, 5.0};
  if (high < 12.0 * low) digits = {1.0, 1.5, 2.0, 3.0, 5.0, 7.0};
  if (high < 4.0 * low) digits = {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0};
  if (high > 300.0 * low) digits = {1.0};
  std::vector<double> ticks;
  for (double power = std::floor(std::log10(low)); power <= std::log10(high); power += 1.0) {
    for (const double digit : digits) {
      const double tick = digit * std::pow(10.0, power);
      if (tick >= low && tick <= high) ticks.push_back(tick);
    }
  }
  return ticks;
}

void draw_forest_plot(const std::filesystem::path& path, const ForestPlot& plot) {
  Canvas measure(kPageWidth, 100.0);
  double labels = 0.0;
  double texts = 0.0;
  for (const ForestRow& row : plot.rows) {
    labels = std::max(labels, measure.text_width(row.label, ink::letter));
    texts = std::max(texts, measure.text_width(row_text(row), ink::letter));
  }
  constexpr double kLeastAxis = 300.0;  // long names widen the sheet instead of narrowing the axis
  const double width = std::max(kPageWidth, labels + texts + 4.0 * kMargin + kLeastAxis);
  const double height = kTop + kRow * static_cast<double>(std::max<std::size_t>(plot.rows.size(), 1)) + kBottom;
  Canvas canvas(width, height);
  const CanvasBox box{2.0 * kMargin + labels, kTop, width - 2.0 * kMargin - texts, height - kBottom};
  ForestDrawing drawing(canvas, box, axis_of(plot.rows));
  drawing.axis(plot.axis, 0.5 * width);
  for (std::size_t i = 0; i < plot.rows.size(); ++i) {
    const ForestRow& row = plot.rows[i];
    const double y = kTop + kRow * (static_cast<double>(i) + 0.5);
    canvas.text({kMargin, y}, row.label, ink::letter, ink::text, Anchor::begin, Anchor::middle);
    drawing.pairs(row.ratios, y);
    if (row.estimate) drawing.estimate(*row.estimate, y);
    canvas.text({box.right + kMargin, y}, row_text(row), ink::letter, ink::text, Anchor::begin, Anchor::middle);
  }
  canvas.frame(box, ink::frame, 1.0);
  canvas.save(path);
}

}  // namespace lodestone::figures
