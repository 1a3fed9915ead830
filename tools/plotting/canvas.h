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

/// Colour-blind safe colours (Okabe and Ito 2008) for the i-th series; they repeat after seven.
Color series_color(std::size_t index);

/// Colours for shares from 0 to 1.
enum class ColorRamp {
  heat,        ///< viridis, lightened as a background of lines
  difference,  ///< white to dark red
  grey,        ///< near white to dark grey: backgrounds
  pale_grey,   ///< light greys: backgrounds of coloured lines
  vivid,       ///< plasma, from dark blue to yellow: lines on grey
};

/// The colour of a share. Shares outside 0 to 1 get the colours of the ends.
Color color_of(ColorRamp ramp, double share);

/// The same for a raster: blue, green, red, opacity. NaN is transparent.
cv::Mat4b colored(const cv::Mat1f& shares, ColorRamp ramp);

/// A point of the canvas: x to the right, y down, logical pixels. A PNG has two real pixels per logical pixel. In PDF
/// and SVG, a logical pixel is half a point (1/144 inch): a column has 504, a page 1032, letters of 7.5 pt have 15.
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

/// A white sheet to draw on. It records the drawing and saves it as PNG, PDF and SVG; in the latter two, text stays
/// text. The font is DejaVu Sans if installed. The same calls give the same bytes.
class Canvas {
 public:
  Canvas(double width, double height);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// Later drawing is clipped at this box until `unclip`. Frames and text are never clipped.
  void clip(const CanvasBox& box);
  void unclip();

  void fill(const CanvasBox& box, Color color, double opacity = 1.0);
  void polygon(const std::vector<CanvasPoint>& corners, Color color, double opacity = 1.0);
  void frame(const CanvasBox& box, Color color, double width);
  void line(CanvasPoint from, CanvasPoint to, Color color, double width, Stroke stroke = Stroke::solid);
  void polyline(const std::vector<CanvasPoint>& points, Color color, double width, Stroke stroke = Stroke::solid);
  void disk(CanvasPoint center, double radius, Color color);

  /// The real pixels of the part of a box on the sheet. A real pixel (column, row) has its centre at
  /// (column + 0.5, row + 0.5) / 2 logical pixels.
  cv::Rect pixels_of(const CanvasBox& box) const;

  /// Colours the real pixels of a box: `shares` has one value per pixel of `pixels_of(box)`. NaN is transparent. PDF
  /// and SVG contain an image of this resolution.
  void shade(const CanvasBox& box, const cv::Mat1f& shares, ColorRamp ramp);

  /// The same with the share at the centre of each real pixel.
  void shade(const CanvasBox& box, const std::function<double(CanvasPoint)>& share, ColorRamp ramp);

  /// `size` is the height of the letters in logical pixels. The anchors state which part of the text is at `at`.
  void text(CanvasPoint at, const std::string& text, double size, Color color, Anchor horizontal, Anchor vertical);

  /// The same, rotated to be read upwards; centred at `center`.
  void vertical_text(CanvasPoint center, const std::string& text, double size, Color color);

  double text_width(const std::string& text, double size) const;

  /// Writes the format of the extension (.png, .pdf, .svg); without such an extension, all three formats. Files are
  /// written under a temporary name and renamed. Throws InputError if this fails.
  void save(const std::filesystem::path& path) const;

 private:
  struct Sheet;
  std::unique_ptr<Sheet> sheet_;
};

}  // namespace lodestone
