#include "tools/plotting/canvas.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "frontends/configuration/text_file.h"
#include "tools/plotting/drawing_files.h"

namespace lodestone {

namespace {

constexpr double kCapitalHeight = 0.73;  // of DejaVu Sans, relative to the letter size

/// Snaps edges parallel to the sheet to whole pixels of the PNG, so that they are sharp.
double snap_to_pixel(double logical) {
  return std::round(logical * kPixelsPerLogical) / kPixelsPerLogical;
}

/// Limits coordinates to the range of the libraries: a lost estimate may be kilometres away.
CanvasPoint clamp_point(CanvasPoint point) {
  constexpr double kLimit = 2e4;
  return {std::clamp(point.x, -kLimit, kLimit), std::clamp(point.y, -kLimit, kLimit)};
}

/// Replaces invalid UTF-8 and control characters by '?': otherwise the writers refuse the whole picture.
std::string sanitize_text(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    std::size_t length = 1;
    if (byte >= 0xC2 && byte <= 0xDF) length = 2;
    if (byte >= 0xE0 && byte <= 0xEF) length = 3;
    bool good = length > 1 ? i + length <= text.size() : byte >= 0x20 && byte < 0x7F;
    for (std::size_t k = 1; good && k < length; ++k) good = (static_cast<unsigned char>(text[i + k]) & 0xC0U) == 0x80U;
    const auto second = length == 3 && good ? static_cast<unsigned char>(text[i + 1]) : 0x80U;
    if (byte == 0xE0 && second < 0xA0U) good = false;
    if (byte == 0xED && second >= 0xA0U) good = false;
    result += good ? std::string(text.substr(i, length)) : "?";
    i += good ? length : 1;
  }
  return result;
}

}  // namespace

struct Canvas::Sheet {
  Drawing drawing;
  std::optional<CanvasBox> clip;

  template <class Shape>
  void add(Shape shape) {
    drawing.marks.push_back({std::move(shape), clip});
  }
};

Canvas::Canvas(double width, double height) : sheet_(std::make_unique<Sheet>()) {
  sheet_->drawing.width = width;
  sheet_->drawing.height = height;
}

Canvas::~Canvas() = default;

void Canvas::clip(const CanvasBox& box) {
  sheet_->clip = box;
}

void Canvas::unclip() {
  sheet_->clip.reset();
}

void Canvas::fill(const CanvasBox& box, Color color, double opacity) {
  const CanvasBox on{snap_to_pixel(box.left), snap_to_pixel(box.top), snap_to_pixel(box.right),
                     snap_to_pixel(box.bottom)};
  polygon({{on.left, on.top}, {on.right, on.top}, {on.right, on.bottom}, {on.left, on.bottom}}, color, opacity);
}

void Canvas::polygon(const std::vector<CanvasPoint>& corners, Color color, double opacity) {
  AreaMark area{{}, color, opacity};
  for (const CanvasPoint& corner : corners) {
    if (std::isfinite(corner.x) && std::isfinite(corner.y)) area.corners.push_back(clamp_point(corner));
  }
  if (area.corners.size() > 2) sheet_->add(std::move(area));
}

void Canvas::frame(const CanvasBox& box, Color color, double width) {
  const CanvasBox on{snap_to_pixel(box.left), snap_to_pixel(box.top), snap_to_pixel(box.right),
                     snap_to_pixel(box.bottom)};
  LineMark line{{{on.left, on.top}, {on.right, on.top}, {on.right, on.bottom}, {on.left, on.bottom}}, color, width};
  line.closed = true;
  sheet_->drawing.marks.push_back({std::move(line), std::nullopt});
}

void Canvas::line(CanvasPoint from, CanvasPoint to, Color color, double width, Stroke stroke) {
  if (from.x == to.x) from.x = to.x = snap_to_pixel(to.x);
  if (from.y == to.y) from.y = to.y = snap_to_pixel(to.y);
  polyline({from, to}, color, width, stroke);
}

void Canvas::polyline(const std::vector<CanvasPoint>& points, Color color, double width, Stroke stroke) {
  constexpr double kSame = 0.05;  // points closer than this are merged, for a smaller file
  LineMark line{{}, color, width, stroke};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i].x) || !std::isfinite(points[i].y)) continue;
    const CanvasPoint point = clamp_point(points[i]);
    const bool near =
        !line.points.empty() && std::hypot(point.x - line.points.back().x, point.y - line.points.back().y) < kSame;
    if (!near || i + 1 == points.size()) line.points.push_back(point);
  }
  if (line.points.size() > 1) sheet_->add(std::move(line));
}

void Canvas::disk(CanvasPoint center, double radius, Color color) {
  if (std::isfinite(center.x) && std::isfinite(center.y)) sheet_->add(DiskMark{clamp_point(center), radius, color});
}

cv::Rect Canvas::pixels_of(const CanvasBox& box) const {
  const auto pixel = [](double logical) { return static_cast<int>(std::lround(logical * kPixelsPerLogical)); };
  const cv::Point first(pixel(std::max(0.0, box.left)), pixel(std::max(0.0, box.top)));
  const cv::Point last(pixel(std::min(sheet_->drawing.width, box.right)),
                       pixel(std::min(sheet_->drawing.height, box.bottom)));
  return {first.x, first.y, std::max(0, last.x - first.x), std::max(0, last.y - first.y)};
}

void Canvas::shade(const CanvasBox& box, const cv::Mat1f& shares, ColorRamp ramp) {
  const cv::Rect pixels = pixels_of(box);
  if (pixels.empty()) return;
  const CanvasBox covered{pixels.x / kPixelsPerLogical, pixels.y / kPixelsPerLogical, pixels.br().x / kPixelsPerLogical,
                          pixels.br().y / kPixelsPerLogical};
  sheet_->add(ImageMark{covered, colored(shares, ramp)});
}

void Canvas::shade(const CanvasBox& box, const std::function<double(CanvasPoint)>& share, ColorRamp ramp) {
  const cv::Rect pixels = pixels_of(box);
  cv::Mat1f shares(pixels.size());
  for (int row = 0; row < shares.rows; ++row) {
    for (int column = 0; column < shares.cols; ++column) {
      shares(row, column) = static_cast<float>(
          share({(pixels.x + column + 0.5) / kPixelsPerLogical, (pixels.y + row + 0.5) / kPixelsPerLogical}));
    }
  }
  shade(box, shares, ramp);
}

double Canvas::text_width(const std::string& text, double size) const {
  return advance_of(sanitize_text(text), size);
}

void Canvas::text(CanvasPoint at, const std::string& text, double size, Color color, Anchor horizontal,
                  Anchor vertical) {
  if (text.empty()) return;
  // The height of a capital for any text, so that neighbouring texts are on one line.
  if (vertical == Anchor::begin) at.y += kCapitalHeight * size;
  if (vertical == Anchor::middle) at.y += 0.5 * kCapitalHeight * size;
  sheet_->drawing.marks.push_back({TextMark{at, sanitize_text(text), size, color, horizontal, false}, std::nullopt});
}

void Canvas::vertical_text(CanvasPoint center, const std::string& text, double size, Color color) {
  if (text.empty()) return;
  center.x += 0.5 * kCapitalHeight * size;
  sheet_->drawing.marks.push_back(
      {TextMark{center, sanitize_text(text), size, color, Anchor::middle, true}, std::nullopt});
}

void Canvas::save(const std::filesystem::path& path) const {
  const std::filesystem::path extension = path.extension();
  const bool all = extension != ".png" && extension != ".pdf" && extension != ".svg";
  const auto target = [&](const char* ending) { return all ? std::filesystem::path(path.string() + ending) : path; };
  if (all || extension == ".png") write_text_file(target(".png"), png_of(sheet_->drawing));
  if (all || extension == ".pdf") write_text_file(target(".pdf"), pdf_of(sheet_->drawing));
  if (all || extension == ".svg") write_text_file(target(".svg"), svg_of(sheet_->drawing));
}

}  // namespace lodestone
