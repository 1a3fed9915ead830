#include "tools/plotting/axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lodestone {

std::vector<double> round_ticks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || count < 1) return ticks;
  const double rough = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough * 0.999) step = factor * power;
  }
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1.0) ticks.push_back(i * step);
  return ticks;
}

std::vector<double> decade_ticks(double low, double high) {
  std::vector<double> ticks;
  const int last = static_cast<int>(std::floor(std::log10(high) + 1e-9));
  for (int power = static_cast<int>(std::ceil(std::log10(low) - 1e-9)); power <= last; ++power) {
    ticks.push_back(std::pow(10.0, power));
  }
  return ticks;
}

std::string tick_text(double value) {
  // Coordinates of a country have seven digits before the point.
  const int digits = std::abs(value) < 1e8 ? 10 : 6;
  return fmt::format("{:.{}g}", std::abs(value) < 1e-12 ? 0.0 : value, digits);
}

double Scale::share(double value) const {
  if (!logarithmic) return (value - low) / (high - low);
  return std::log(std::max(value, low) / low) / std::log(high / low);
}

std::vector<double> Scale::ticks(int count) const {
  return logarithmic ? decade_ticks(low, high) : round_ticks(low, high, count);
}

std::vector<double> Scale::minor_ticks() const {
  std::vector<double> ticks;
  constexpr double kMostDecades = 6.0;
  if (!logarithmic || !(high < low * std::pow(10.0, kMostDecades))) return ticks;
  for (double power = std::pow(10.0, std::floor(std::log10(low) + 1e-9)); power < high; power *= 10.0) {
    for (int digit = 2; digit < 10; ++digit) {
      if (digit * power >= low && digit * power <= high) ticks.push_back(digit * power);
    }
  }
  return ticks;
}

void Axes::grid(int x_count, int y_count) {
  for (const double x : x_.ticks(x_count)) canvas_.line(at(x, y_.low), at(x, y_.high), ink::grid, 1.0);
  for (const double y : y_.ticks(y_count)) canvas_.line(at(x_.low, y), at(x_.high, y), ink::grid, 1.0);
}

double Axes::ticks(bool x_numbers, bool y_numbers, int x_count, int y_count) {
  canvas_.frame(box_, ink::frame, 1.0);
  double widest = 0.0;
  for (const double y : y_.ticks(y_count)) {
    const CanvasPoint tick = at(x_.low, y);
    canvas_.line({tick.x - 5.0, tick.y}, tick, ink::frame, 1.0);
    if (!y_numbers) continue;
    canvas_.text({tick.x - 9.0, tick.y}, tick_text(y), ink::letter, ink::text, Anchor::end, Anchor::middle);
    widest = std::max(widest, canvas_.text_width(tick_text(y), ink::letter));
  }
  for (const double x : x_.ticks(x_count)) {
    const CanvasPoint tick = at(x, y_.low);
    canvas_.line(tick, {tick.x, tick.y + 5.0}, ink::frame, 1.0);
    if (!x_numbers) continue;
    canvas_.text({tick.x, tick.y + 10.0}, tick_text(x), ink::letter, ink::text, Anchor::middle, Anchor::begin);
  }
  for (const double y : y_.minor_ticks())
    canvas_.line({box_.left - 3.0, at(x_.low, y).y}, at(x_.low, y), ink::frame, 0.6);
  for (const double x : x_.minor_ticks())
    canvas_.line(at(x, y_.low), {at(x, y_.low).x, box_.bottom + 3.0}, ink::frame, 0.6);
  return widest;
}

void Axes::labels(const std::string& x_title, const std::string& y_title, int x_count, int y_count) {
  const double widest = ticks(!x_title.empty(), true, x_count, y_count);
  canvas_.vertical_text({box_.left - 28.0 - widest, 0.5 * (box_.top + box_.bottom)}, y_title, ink::letter, ink::text);
  canvas_.text({0.5 * (box_.left + box_.right), box_.bottom + 34.0}, x_title, ink::letter, ink::text, Anchor::middle,
               Anchor::begin);
}

void Axes::curve(const std::vector<double>& x, const std::vector<double>& y, Color color, double width, Stroke stroke) {
  canvas_.clip(box_);
  std::vector<CanvasPoint> points;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i])) {
      points.push_back(at(x[i], y[i]));
    } else {
      canvas_.polyline(points, color, width, stroke);
      points.clear();
    }
  }
  canvas_.polyline(points, color, width, stroke);
  canvas_.unclip();
}

void Axes::ribbon(const std::vector<double>& x, const std::vector<double>& low, const std::vector<double>& high,
                  Color color, double opacity) {
  canvas_.clip(box_);
  std::vector<CanvasPoint> there;
  std::vector<CanvasPoint> back;
  const auto paint = [&]() {
    there.insert(there.end(), back.rbegin(), back.rend());
    canvas_.polygon(there, color, opacity);
    there.clear();
    back.clear();
  };
  for (std::size_t i = 0; i < std::min({x.size(), low.size(), high.size()}); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(low[i]) && std::isfinite(high[i])) {
      there.push_back(at(x[i], low[i]));
      back.push_back(at(x[i], high[i]));
    } else {
      paint();
    }
  }
  paint();
  canvas_.unclip();
}

void Axes::band(double x0, double x1, Color color, double opacity) {
  CanvasBox box = box_;
  box.left = std::max(box_.left, at(x0, y_.low).x);
  box.right = std::min(box_.right, at(x1, y_.low).x);
  if (box.right > box.left) canvas_.fill(box, color, opacity);
}

double draw_legend(Canvas& canvas, CanvasPoint from, double right, const std::vector<LegendEntry>& entries) {
  constexpr double kRow = 24.0;
  constexpr double kSample = 30.0;
  CanvasPoint pen = from;
  for (const LegendEntry& entry : entries) {
    const double width = kSample + 8.0 + canvas.text_width(entry.name, ink::letter);
    if (pen.x > from.x && pen.x + width > right) pen = {from.x, pen.y + kRow};
    const double middle = pen.y + 0.5 * kRow;
    if (entry.patch) {
      canvas.fill({pen.x, middle - 7.0, pen.x + kSample, middle + 7.0}, entry.color);
    } else {
      canvas.line({pen.x, middle}, {pen.x + kSample, middle}, entry.color, entry.width, entry.stroke);
    }
    canvas.text({pen.x + kSample + 8.0, middle}, entry.name, ink::letter, ink::text, Anchor::begin, Anchor::middle);
    pen.x += width + 28.0;
  }
  return entries.empty() ? 0.0 : pen.y - from.y + kRow;
}

}  // namespace lodestone
