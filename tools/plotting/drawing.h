#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/plotting/canvas.h"

namespace lodestone {

/// Recorded marks of a canvas, in logical pixels. The input of the writers of PNG, PDF and SVG.

struct AreaMark {
  std::vector<CanvasPoint> corners;
  Color color;
  double opacity = 1.0;
};

struct LineMark {
  std::vector<CanvasPoint> points;
  Color color;
  double width = 1.0;
  Stroke stroke = Stroke::solid;
  bool closed = false;
};

struct DiskMark {
  CanvasPoint center;
  double radius = 1.0;
  Color color;
};

struct ImageMark {
  CanvasBox box;
  cv::Mat4b pixels;  ///< row by row from the top: blue, green, red, opacity; either opaque or all 0
};

struct TextMark {
  CanvasPoint at;  ///< on the baseline, at the text's begin, middle or end
  std::string text;
  double size = 1.0;
  Color color;
  Anchor anchor = Anchor::begin;
  bool upward = false;  ///< read upwards
};

struct Mark {
  std::variant<AreaMark, LineMark, DiskMark, ImageMark, TextMark> shape;
  std::optional<CanvasBox> clip;
};

struct Drawing {
  double width = 0.0;
  double height = 0.0;
  std::vector<Mark> marks;
};

constexpr double kPixelsPerLogical = 2.0;  ///< of the PNG, and of images in PDF and SVG
constexpr double kPointsPerLogical = 0.5;  ///< of PDF and SVG: 15 logical pixels are letters of 7.5 pt
constexpr double kDashes[2] = {5.0, 2.5};  ///< dash and gap, in line widths
constexpr double kDots[2] = {1.3, 1.7};

}  // namespace lodestone
