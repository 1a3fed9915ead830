#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace lodestone {

struct Color {
  int red = 0;
  int green = 0;
  int blue = 0;
};

/// Colours that the colour-blind tell apart too (Okabe and Ito 2008), for the i-th series; they repeat after seven.
Color series_color(std::size_t index);

/// A share (0 to 1) as a colour of the perceptually even viridis scale, paled so that lines stand out on it.
Color heat_color(double share);

/// A point of the canvas: x to the right, y down, logical pixels. The file has two real pixels to each.
struct CanvasPoint {
  double x = 0.0;
  double y = 0.0;
};

struct CanvasBox {
  double left = 0.0;
  double top = 0.0;
  double right = 0.0;
  double bottom = 0.0;
  double width() const { return right - left; }
  double height() const { return bottom - top; }
};

enum class Anchor { begin, middle, end };

/// A white sheet to draw on, with anti-aliased lines and text. Text is set in DejaVu Sans where the machine has it, else
/// in OpenCV's stroke font, in which letters beyond ASCII become their nearest ASCII spelling.
class Canvas {
 public:
  Canvas(double width, double height);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// What follows is cut off at this box, until `unclip`. Frames and text are never cut.
  void clip(const CanvasBox& box);
  void unclip();

  void fill(const CanvasBox& box, Color color, double opacity = 1.0);
  void frame(const CanvasBox& box, Color color, double width);
  void line(CanvasPoint from, CanvasPoint to, Color color, double width);
  void polyline(const std::vector<CanvasPoint>& points, Color color, double width);
  void disk(CanvasPoint center, double radius, Color color);

  /// Calls `color` for the centre of every real pixel of the box; where it gives false the pixel stays as it is.
  void shade(const CanvasBox& box, const std::function<bool(CanvasPoint, Color&)>& color);

  /// `size` is the height of the letters in logical pixels; the anchors say which part of the text lies at `at`.
  void text(CanvasPoint at, const std::string& text, double size, Color color, Anchor horizontal, Anchor vertical);

  /// The same, read from below to above; centred at `center`, on white.
  void vertical_text(CanvasPoint center, const std::string& text, double size, Color color);

  double text_width(const std::string& text, double size) const;

  /// Writes a PNG aside and renames it. Throws InputError where that fails.
  void save(const std::filesystem::path& path) const;

 private:
  struct Sheet;
  std::unique_ptr<Sheet> sheet_;
};

}  // namespace lodestone
