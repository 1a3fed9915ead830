#include "tools/plotting/difference_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "tools/plotting/axes.h"
#include "tools/plotting/color_bar.h"
#include "tools/plotting/plan_sheet.h"

namespace lodestone {
namespace {

/// Finds |ΔB| at a point: pieces by their place.
class ChangeLookup {
 public:
  explicit ChangeLookup(const MagneticDifference& difference) : grid_(difference.grid) {
    for (const DifferencePiece& piece : difference.pieces) {
      pieces_[{piece.row, piece.column}] = &piece;
      rows_ = std::max(rows_, piece.rows);
      columns_ = std::max(columns_, piece.columns);
    }
    // Pieces at the grid's upper and right edges may be smaller; all begin at multiples of the largest.
  }

  /// At the nearest node, µT; negative where nothing was compared.
  double at(double x, double y) const {
    const int column = static_cast<int>(std::lround((x - grid_.origin.x()) / grid_.resolution_m));
    const int row = static_cast<int>(std::lround((y - grid_.origin.y()) / grid_.resolution_m));
    if (column < 0 || row < 0 || pieces_.empty()) return -1.0;
    auto next = pieces_.upper_bound({row, column});
    while (next != pieces_.begin()) {
      --next;
      const DifferencePiece& piece = *next->second;
      if (piece.row + rows_ <= row) return -1.0;
      if (row < piece.row + piece.rows && column >= piece.column && column < piece.column + piece.columns) {
        return piece.change(row - piece.row, column - piece.column);
      }
    }
    return -1.0;
  }

 private:
  const FieldGrid& grid_;
  std::map<std::pair<int, int>, const DifferencePiece*> pieces_;
  int rows_ = 0;
  int columns_ = 0;
};

/// From 0 to the 99.5 % quantile of the nodes: a single bolt must not take the whole scale.
Scale change_range(const MagneticDifference& difference) {
  std::vector<double> changes;
  for (const DifferencePiece& piece : difference.pieces) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        if (const double change = piece.change(row, column); change >= 0.0) changes.push_back(change);
      }
    }
  }
  if (changes.empty()) return {0.0, 1.0};
  const auto nth = changes.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(changes.size() - 1));
  std::nth_element(changes.begin(), nth, changes.end());
  return {0.0, std::max(*nth, 0.1)};
}

PlanStretch stretch_of(const MagneticDifference& difference) {
  PlanStretch stretch;
  const FieldGrid& grid = difference.grid;
  for (const DifferencePiece& piece : difference.pieces) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        if (piece.change(row, column) < 0.0) continue;
        const Eigen::Vector2d at =
            grid.origin + grid.resolution_m * Eigen::Vector2d(piece.column + column, piece.row + row);
        stretch.include(at.x(), at.y());
      }
    }
  }
  stretch.widen(0.5, 0.02);
  return stretch;
}

/// A ring, white and black so that it shows on every colour.
void draw_ring(Canvas& canvas, CanvasPoint center, double radius) {
  constexpr int corners = 40;
  std::vector<CanvasPoint> ring;
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2.0 * M_PI * i / corners;
    ring.push_back({center.x + radius * std::cos(angle), center.y + radius * std::sin(angle)});
  }
  canvas.polyline(ring, ink::white, 5.0);
  canvas.polyline(ring, ink::truth, 2.0);
}

/// Text on a white plate, within `box`.
void draw_note(Canvas& canvas, const CanvasBox& box, CanvasPoint at, const std::string& text, double size) {
  const double width = canvas.text_width(text, size) + 8.0;
  const double left = std::clamp(at.x, box.left, std::max(box.left, box.right - width));
  const double top = std::clamp(at.y - 0.5 * size - 5.0, box.top, box.bottom - size - 10.0);
  canvas.fill({left, top, left + width, top + size + 10.0}, ink::white, 0.8);
  canvas.text({left + 4.0, top + 0.5 * size + 5.0}, text, size, ink::text, Anchor::begin, Anchor::middle);
}

}  // namespace

void draw_difference_picture(const std::filesystem::path& path, const MagneticDifference& difference,
                             const std::vector<ChangedPlace>& places, const std::string& title) {
  const PlanSheet sheet = plan_sheet(stretch_of(difference), 76.0);
  const CanvasBox& box = sheet.box;
  Canvas canvas(sheet.width, sheet.height);
  canvas.text({box.left, 14.0}, title, ink::title, ink::text, Anchor::begin, Anchor::begin);
  canvas.text({box.left, 42.0},
              fmt::format("{:.1f} m² compared; mean {:.2f}, 95 % below {:.2f}, largest {:.2f} µT", difference.compared_m2,
                          difference.mean_ut, difference.high_ut, difference.largest_ut),
              ink::letter, ink::text, Anchor::begin, Anchor::begin);

  const Scale scale = change_range(difference);
  const ChangeLookup lookup(difference);
  const PlanStretch& stretch = sheet.stretch;
  Axes axes(canvas, box, {stretch.x_low, stretch.x_high}, {stretch.y_low, stretch.y_high});
  canvas.fill(box, {240, 240, 240});
  canvas.shade(box, [&](CanvasPoint point, Color& color) {
    const double change = lookup.at(sheet.x_at(point.x), sheet.y_at(point.y));
    if (change >= 0.0) color = heat_color(scale.share(change));
    return change >= 0.0;
  });
  draw_color_bar(canvas, sheet.color_bar(), scale, heat_color, "|ΔB| µT");
  for (std::size_t i = 1; i < std::min<std::size_t>(places.size(), 10); ++i) {
    const CanvasPoint at = axes.at(places[i].largest_at.x(), places[i].largest_at.y());
    draw_note(canvas, box, {at.x + 4.0, at.y}, std::to_string(i + 1), 12.0);
  }
  if (difference.nodes > 0) {
    const CanvasPoint at = axes.at(difference.largest_at.x(), difference.largest_at.y());
    draw_ring(canvas, at, 11.0);
    draw_note(canvas, box, {at.x + 18.0, at.y},
              fmt::format("{:.1f} µT at {:.2f}, {:.2f} m", difference.largest_ut, difference.largest_at.x(),
                          difference.largest_at.y()),
              ink::letter);
  }
  axes.labels("x, m", "y, m", sheet.x_ticks, sheet.y_ticks);
  canvas.save(path);
}

}  // namespace lodestone
