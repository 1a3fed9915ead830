#pragma once

#include <string>
#include <vector>

#include "tools/plotting/canvas.h"

namespace lodestone {

/// Round values between `low` and `high` that divide the range into about `count` parts.
std::vector<double> round_ticks(double low, double high, int count);

/// Powers of ten between `low` and `high`; both limits are positive.
std::vector<double> decade_ticks(double low, double high);

/// Short text of a value for an axis.
std::string tick_text(double value);

/// The range of values of one axis.
struct Scale {
  double low = 0.0;
  double high = 1.0;
  bool logarithmic = false;

  /// 0 at `low`, 1 at `high`. On a logarithmic scale, values at or below 0 are at the lower edge.
  double share(double value) const;
  std::vector<double> ticks(int count) const;

  /// The multiples 2 to 9 of powers of ten on a logarithmic scale. None on a linear scale or over many decades.
  std::vector<double> minor_ticks() const;
};

/// A box with two axes for data.
class Axes {
 public:
  Axes(Canvas& canvas, CanvasBox box, Scale x, Scale y) : canvas_(canvas), box_(box), x_(x), y_(y) {}

  CanvasPoint at(double x, double y) const {
    return {box_.left + x_.share(x) * box_.width(), box_.bottom - y_.share(y) * box_.height()};
  }

  /// Fine lines at the ticks, below the data.
  void grid(int x_count, int y_count);

  /// Frame, ticks with numbers, and titles. Without `x_title`, the x axis has no numbers; the panel below has them.
  void labels(const std::string& x_title, const std::string& y_title, int x_count, int y_count);

  /// Frame and ticks, optionally with numbers. Logarithmic axes also have minor ticks. Returns the width of the widest
  /// number of the y axis.
  double ticks(bool x_numbers, bool y_numbers, int x_count, int y_count);

  /// A line through the points, clipped at the box. Points that are not finite interrupt the line.
  void curve(const std::vector<double>& x, const std::vector<double>& y, Color color, double width,
             Stroke stroke = Stroke::solid);

  /// The area between two curves over the same x, clipped at the box; interrupted like a curve.
  void ribbon(const std::vector<double>& x, const std::vector<double>& low, const std::vector<double>& high,
              Color color, double opacity);

  /// The interval from x0 to x1 in full height.
  void band(double x0, double x1, Color color, double opacity);

  const CanvasBox& box() const { return box_; }

 private:
  Canvas& canvas_;
  CanvasBox box_;
  Scale x_;
  Scale y_;
};

struct LegendEntry {
  std::string name;
  Color color;
  double width = 2.0;  ///< of the line
  bool patch = false;  ///< a filled patch instead of a line
  Stroke stroke = Stroke::solid;
};

/// Entries side by side from `from` on. Entries that do not fit before `right` start a new row. Returns the height.
double draw_legend(Canvas& canvas, CanvasPoint from, double right, const std::vector<LegendEntry>& entries);

/// Colours and sizes of all pictures.
namespace ink {
constexpr Color text{40, 40, 40};
constexpr Color frame{90, 90, 90};
constexpr Color grid{226, 226, 226};
constexpr Color truth{0, 0, 0};
constexpr Color shade{150, 150, 150};
constexpr Color white{255, 255, 255};
constexpr double letter = 15.0;
constexpr double title = 18.0;
}  // namespace ink

}  // namespace lodestone
