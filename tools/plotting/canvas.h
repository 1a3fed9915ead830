#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
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

/// Colours for shares from 0 to 1.
enum class ColorRamp {
  heat,        ///< viridis, paled so that lines stand out on it
  difference,  ///< white to dark red
  grey,        ///< near white to dark grey: backgrounds
  pale_grey,   ///< light greys: backgrounds of coloured lines
  vivid,       ///< plasma, dark blue over magenta to yellow: lines on grey
};

/// The colour of a share. Shares beyond 0 and 1 have the colours of the ends.
Color color_of(ColorRamp ramp, double share);

/// The same for a raster: blue, green, red, opacity. NaN is transparent.
cv::Mat4b colored(const cv::Mat1f& shares, ColorRamp ramp);

/// A point of the canvas: x to the right, y down, logical pixels. A PNG has two real pixels to each; in PDF and SVG
/// each is half a point (1/144 inch): 504 are the column of a paper, 1032 its page, 15 a letter of 7.5 pt.
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

enum class Stroke { solid, dashed, dotted };

/// A white sheet to draw on. It keeps what is drawn, so that one drawing is saved as PNG, PDF and SVG; letters stay
/// letters in the latter two. Text is set in DejaVu Sans where the machine has it. The same calls give the same bytes.
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
  void polygon(const std::vector<CanvasPoint>& corners, Color color, double opacity = 1.0);
  void frame(const CanvasBox& box, Color color, double width);
  void line(CanvasPoint from, CanvasPoint to, Color color, double width, Stroke stroke = Stroke::solid);
  void polyline(const std::vector<CanvasPoint>& points, Color color, double width, Stroke stroke = Stroke::solid);
  void disk(CanvasPoint center, double radius, Color color);

  /// The real pixels of a box, as far as the box lies on the sheet. A real pixel (column, row) has its centre at
  /// (column + 0.5, row + 0.5) / 2 logical pixels.
  cv::Rect pixels_of(const CanvasBox& box) const;

  /// Colours the real pixels of a box: `shares` has one value for each of `pixels_of(box)`. Below NaN, the drawing
  /// shows. PDF and SVG contain an image of this resolution.
  void shade(const CanvasBox& box, const cv::Mat1f& shares, ColorRamp ramp);

  /// The same with the share at the centre of each real pixel.
  void shade(const CanvasBox& box, const std::function<double(CanvasPoint)>& share, ColorRamp ramp);

  /// `size` is the height of the letters in logical pixels; the anchors say which part of the text lies at `at`.
  void text(CanvasPoint at, const std::string& text, double size, Color color, Anchor horizontal, Anchor vertical);

  /// The same, read from below to above; centred at `center`.
  void vertical_text(CanvasPoint center, const std::string& text, double size, Color color);

  double text_width(const std::string& text, double size) const;

  /// Writes the file that the extension names (.png, .pdf, .svg), or, without one of these, all three with the
  /// extension appended. Each is written aside and renamed. Throws InputError where that fails.
  void save(const std::filesystem::path& path) const;

 private:
  struct Sheet;
  std::unique_ptr<Sheet> sheet_;
};

}  // namespace lodestone
